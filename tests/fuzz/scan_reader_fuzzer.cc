// Any bytes as a scan of one format; READER is the function that takes them.
#include <cstdint>
#include <sstream>
#include <string>
#include <type_traits>

#include "client/formats/scan_reader.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  const auto read = [&in](auto* reader) {
    constexpr rilievo::WantedLayers kAll = {true, true, true, true};
    if constexpr (std::is_invocable_v<decltype(reader), std::istream&, rilievo::WantedLayers>) {
      return reader(in, kAll);
    } else {
      return reader(in);
    }
  };
  const auto scan = read(&rilievo::READER);
  if (scan.ok()) {
    rilievo::Require(rilievo::CheckSights(scan->cloud.sights, scan->cloud.points.cols()).ok());
    // No format needs less than two bytes for a point.
    rilievo::Require(scan->cloud.points.cols() <= 88 * static_cast<int64_t>(size));
    rilievo::Require(!scan->format.empty());
  } else {
    rilievo::Require(!scan.status().message().empty());
  }
  return 0;
}
