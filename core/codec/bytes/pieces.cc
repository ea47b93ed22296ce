#include "core/codec/bytes/pieces.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

void AppendPieces(const std::vector<std::vector<uint8_t>>& pieces, std::vector<uint8_t>* payload) {
  ByteWriter writer(*payload);
  for (const std::vector<uint8_t>& piece : pieces) writer.Varint(piece.size());
  writer.U32(Crc32c(*payload));
  for (const std::vector<uint8_t>& piece : pieces) {
    if (piece.empty()) continue;
    writer.Bytes(piece);
    writer.U32(Crc32c(piece));
  }
}

absl::StatusOr<std::vector<std::span<const uint8_t>>> ReadPieces(std::span<const uint8_t> payload,
                                                                 size_t start, int count,
                                                                 absl::string_view what) {
  const auto cut_off = [what] { return absl::DataLossError(absl::StrCat(what, " are cut off")); };
  ByteReader reader(payload);
  reader.Bytes(start);
  // Each takes a byte at least: no more are looked for than can be there.
  if (!reader.ok() || reader.remaining() < static_cast<size_t>(count)) return cut_off();
  std::vector<uint64_t> sizes(static_cast<size_t>(count));
  for (uint64_t& size : sizes) size = reader.Varint();
  const size_t index_end = reader.position();
  const uint32_t checksum = reader.U32();
  if (!reader.ok()) return cut_off();
  if (checksum != Crc32c(payload.first(index_end))) {
    return absl::DataLossError(absl::StrCat("the checksum of the index of ", what, " is wrong"));
  }
  std::vector<std::span<const uint8_t>> pieces;
  for (const uint64_t size : sizes) {
    pieces.push_back(size == 0 ? std::span<const uint8_t>() : reader.Bytes(size + 4));
  }
  if (!reader.ok()) return cut_off();
  return pieces;
}

absl::StatusOr<std::span<const uint8_t>> CheckPiece(std::span<const uint8_t> piece,
                                                    absl::string_view what) {
  if (piece.size() < 4) return absl::DataLossError(absl::StrCat(what, " is cut off"));
  const std::span<const uint8_t> bytes = piece.first(piece.size() - 4);
  if (ByteReader(piece.last(4)).U32() == Crc32c(bytes)) return bytes;
  return absl::DataLossError(absl::StrCat(what, " has a wrong checksum"));
}

}  // namespace rilievo
