#include "core/codec/bytes/chunk.h"

#include <algorithm>
#include <array>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {
namespace {

// Like PNG's: a byte no text has, the name, and both kinds of line end, so that a transfer as text
// shows at once.
constexpr std::array<uint8_t, 8> kSignature = {0x89, 'D', 'S', 'S', 0x0d, 0x0a, 0x1a, 0x0a};

absl::Status CheckSignature(std::span<const uint8_t> bytes) {
  const size_t count = std::min(bytes.size(), kSignature.size());
  if (count == 0 || !std::equal(bytes.begin(), bytes.begin() + count, kSignature.begin())) {
    return absl::InvalidArgumentError("not a .dss stream: its signature is missing");
  }
  if (bytes.size() <= kSignature.size()) {
    return absl::DataLossError("the stream ends within its signature");
  }
  const int version = bytes[kSignature.size()];
  if (version > kNewestDssVersion) {
    return absl::UnimplementedError(absl::StrCat("the stream has format version ", version,
                                                 ", this decoder reads up to ", kNewestDssVersion));
  }
  if (version == 0) return absl::InvalidArgumentError("format version 0 does not exist");
  return absl::OkStatus();
}

}  // namespace

std::vector<uint8_t> WrapChunk(uint8_t tag, std::span<const uint8_t> payload, bool first,
                               int version) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  if (first) {
    writer.Bytes(kSignature);
    writer.Byte(static_cast<uint8_t>(version));
  }
  writer.Byte(tag);
  writer.Varint(payload.size());
  writer.Bytes(payload);
  writer.U32(Crc32c(bytes));
  return bytes;
}

absl::StatusOr<ChunkList> ListChunks(std::span<const uint8_t> bytes, bool check) {
  RILIEVO_RETURN_IF_ERROR(CheckSignature(bytes));
  ChunkList list;
  list.version = bytes[kSignature.size()];
  ByteReader reader(bytes);
  reader.Bytes(kSignature.size() + 1);
  size_t begin = 0;
  do {
    Chunk chunk;
    chunk.number = list.chunks.size();
    chunk.tag = reader.Byte();
    chunk.payload = reader.Bytes(reader.Varint());
    const size_t end = reader.position();
    chunk.checksum = reader.U32();
    if (!reader.ok()) {
      return absl::DataLossError(absl::StrCat("chunk ", chunk.number, " is cut off"));
    }
    chunk.checked = bytes.subspan(begin, end - begin);
    if (check) RILIEVO_RETURN_IF_ERROR(CheckChunk(chunk));
    chunk.bytes = static_cast<int64_t>(reader.position() - begin);
    begin = reader.position();
    list.chunks.push_back(chunk);
  } while (reader.remaining() > 0);
  return list;
}

absl::Status CheckChunk(const Chunk& chunk) {
  if (chunk.checksum == Crc32c(chunk.checked)) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("the checksum of chunk ", chunk.number, " is wrong"));
}

}  // namespace rilievo
