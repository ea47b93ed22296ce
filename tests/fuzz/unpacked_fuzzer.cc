// Any bytes as a compressed file: what comes out stays within the limits.
#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>

#include "client/formats/unpacked_input.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  constexpr rilievo::UnpackLimits kLimits{.any_file = 1 << 16, .per_byte = 4};
  for (const rilievo::Packing packing : {rilievo::Packing::kGzip, rilievo::Packing::kZstd}) {
    std::istringstream in(bytes);
    rilievo::UnpackedInput input(in, packing, size, kLimits);
    uint64_t held = 0;
    char block[4096];
    while (input.stream().read(block, sizeof block) || input.stream().gcount() > 0) {
      held += static_cast<uint64_t>(input.stream().gcount());
    }
    rilievo::Require(held <= kLimits.any_file + kLimits.per_byte * size);
    rilievo::Require(input.Finish().ok() || !input.status().message().empty());
  }
  return 0;
}
