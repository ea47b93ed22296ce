// Any bytes as an E57 file, as they are and in sound pages.
#include <cstdint>
#include <sstream>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/fuzz/require.h"
#include "tests/fuzz/right_page_checksums.h"

namespace {

void Read(const std::string& bytes) {
  std::istringstream in(bytes);
  const auto scan = rilievo::ReadE57Scan(in, {true, true, true, true});
  if (scan.ok()) {
    rilievo::Require(rilievo::CheckSights(scan->cloud.sights, scan->cloud.points.cols()).ok());
    // A point takes a bit at least.
    rilievo::Require(scan->cloud.points.cols() <= 8 * static_cast<int64_t>(bytes.size()));
    rilievo::Require(!scan->format.empty());
  } else {
    rilievo::Require(!scan.status().message().empty());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  Read(bytes);
  Read(rilievo::WithRightPageChecksums(bytes));
  return 0;
}
