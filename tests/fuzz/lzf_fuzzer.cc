// LZF both ways: what was packed comes back, and any bytes unpack to what was asked for or not at
// all.
#include <cstdint>
#include <string_view>
#include <vector>

#include "client/formats/lzf.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::vector<char> packed = rilievo::EncodeLzf(bytes);
  const auto back = rilievo::DecodeLzf({packed.data(), packed.size()}, size);
  rilievo::Require(back.ok() && std::string_view(back->data(), back->size()) == bytes);
  if (size < 2) return 0;
  const uint64_t wanted = data[0] + 256u * data[1];
  const auto unpacked = rilievo::DecodeLzf(bytes.substr(2), wanted);
  rilievo::Require(!unpacked.ok() || unpacked->size() == wanted);
  return 0;
}
