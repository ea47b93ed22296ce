#include <cstdint>
#include <span>

#include "absl/status/status.h"
#include "client/decoder_c/guarded.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"

namespace rilievo::decoder_c {
namespace {

constexpr size_t kSignatureBytes = 8;

// INVALID_ARGUMENT as ListChunks() would have it; OK for bytes that may still become a .dss file.
absl::Status CheckBeginning(std::span<const uint8_t> bytes) {
  if (bytes.empty()) return absl::OkStatus();
  const absl::Status status = ListChunks(bytes.first(std::min(bytes.size(), kSignatureBytes + 1)))
                                  .status();  // cut off within its first chunk
  return absl::IsDataLoss(status) ? absl::OkStatus() : status;
}

size_t WholeBytes(std::span<const uint8_t> bytes, int max_level) {
  ByteReader reader(bytes);
  reader.Bytes(kSignatureBytes + 1);
  size_t whole = 0;
  int level = -1;
  while (reader.ok() && reader.remaining() > 0) {
    const uint8_t tag = reader.Byte();
    reader.Bytes(reader.Varint());
    reader.U32();
    if (tag == kHeightsTag) ++level;
    if (!reader.ok() || (max_level >= 0 && level > max_level)) break;
    whole = reader.position();
  }
  return whole;
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_whole_bytes(const uint8_t* bytes, size_t size, int max_level, size_t* whole) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    if (const absl::Status status = NotNull(whole, "whole"); !status.ok()) return status;
    *whole = 0;
    if (size == 0) return absl::OkStatus();
    if (const absl::Status status = NotNull(bytes, "bytes"); !status.ok()) return status;
    if (const absl::Status status = CheckBeginning({bytes, size}); !status.ok()) return status;
    *whole = WholeBytes({bytes, size}, max_level);
    return absl::OkStatus();
  });
}
