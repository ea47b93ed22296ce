#include "core/codec/height_layout.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/byte_stream.h"
#include "core/codec/crc32c.h"

namespace rilievo {
namespace {

absl::Status CheckLayout(const LiftingStep& lifting, uint64_t step, int level) {
  if (lifting.rule < static_cast<int>(kEdgeRules.size()) && step >= 1 && step <= kMaxHeightStep) {
    return absl::OkStatus();
  }
  return absl::DataLossError(absl::StrCat("the layer of level ", level, " names rule ",
                                          lifting.rule, " and step ", step,
                                          ": the format has neither"));
}

}  // namespace

std::vector<uint8_t> WriteHeightLayout(const HeightLayout& layout) {
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  const int lifting = layout.lifting.rule * 16 + layout.lifting.strength;
  writer.Byte(static_cast<uint8_t>(lifting | (layout.empty ? kEmptyLayerFlag : 0)));
  if (layout.empty) return payload;
  writer.Varint(static_cast<uint64_t>(layout.dequantizer.step));
  for (int draw : layout.dequantizer.draw) writer.Byte(static_cast<uint8_t>(draw));
  return payload;
}

absl::StatusOr<HeightLayout> ReadHeightLayout(std::span<const uint8_t> payload, int level) {
  ByteReader reader(payload);
  HeightLayout layout;
  const int first = reader.Byte(), lifting = first & ~kEmptyLayerFlag;
  layout.empty = (first & kEmptyLayerFlag) != 0;
  uint64_t step = 1;
  if (!layout.empty) {
    step = reader.Varint();
    for (int& draw : layout.dequantizer.draw) draw = reader.Byte();
  }
  if (!reader.ok()) {
    return absl::DataLossError(absl::StrCat("the layer of level ", level, " is cut off"));
  }
  layout.lifting.rule = lifting >> 4;
  layout.lifting.strength = lifting & 15;
  RILIEVO_RETURN_IF_ERROR(CheckLayout(layout.lifting, step, level));
  layout.dequantizer.step = static_cast<int32_t>(step);
  layout.coded = payload.subspan(reader.position());
  return layout;
}

std::vector<uint8_t> WriteGroupedLayout(const LiftingStep& lifting, int32_t step,
                                        const std::vector<std::vector<uint8_t>>& pieces) {
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  writer.Byte(static_cast<uint8_t>(lifting.rule * 16 + lifting.strength));
  writer.Varint(static_cast<uint64_t>(step));
  for (const std::vector<uint8_t>& piece : pieces) writer.Varint(piece.size());
  writer.U32(Crc32c(payload));
  for (const std::vector<uint8_t>& piece : pieces) {
    if (piece.empty()) continue;
    writer.Bytes(piece);
    writer.U32(Crc32c(piece));
  }
  return payload;
}

absl::StatusOr<GroupedLayout> ReadGroupedLayout(std::span<const uint8_t> payload, int level,
                                                int group_count) {
  ByteReader reader(payload);
  GroupedLayout layout;
  const int first = reader.Byte();
  layout.lifting.rule = first >> 4;
  layout.lifting.strength = first & 15;
  const uint64_t step = reader.Varint();
  const auto cut_off = [level] {
    return absl::DataLossError(absl::StrCat("the groups of level ", level, " are cut off"));
  };
  // Each takes a byte at least: no more are looked for than can be there.
  if (reader.remaining() < static_cast<size_t>(group_count)) return cut_off();
  std::vector<uint64_t> sizes(group_count);
  for (uint64_t& size : sizes) size = reader.Varint();
  const size_t index_end = reader.position();
  const uint32_t checksum = reader.U32();
  if (!reader.ok()) return cut_off();
  if (checksum != Crc32c(payload.first(index_end))) {
    return absl::DataLossError(
        absl::StrCat("the checksum of the groups' index of level ", level, " is wrong"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckLayout(layout.lifting, step, level));
  layout.step = static_cast<int32_t>(step);
  for (uint64_t size : sizes) {
    layout.pieces.push_back(size == 0 ? std::span<const uint8_t>() : reader.Bytes(size + 4));
  }
  if (!reader.ok()) return cut_off();
  return layout;
}

std::vector<uint8_t> WritePieceLayout(const PieceLayout& layout) {
  if (layout.empty) return {kEmptyLayerFlag};
  return {0, static_cast<uint8_t>(layout.draw[0]), static_cast<uint8_t>(layout.draw[1])};
}

absl::StatusOr<PieceLayout> ReadPieceLayout(std::span<const uint8_t> piece, int level, int group) {
  const auto refuse = [&](const char* why) {
    return absl::DataLossError(absl::StrCat("group ", group, " of level ", level, " ", why));
  };
  if (piece.size() < 5) return refuse("is cut off");
  const std::span<const uint8_t> bytes = piece.first(piece.size() - 4);
  if (ByteReader(piece.last(4)).U32() != Crc32c(bytes)) return refuse("has a wrong checksum");
  ByteReader reader(bytes);
  PieceLayout layout;
  const int flags = reader.Byte();
  if ((flags & ~kEmptyLayerFlag) != 0) return refuse("has flags the format does not know");
  layout.empty = flags != 0;
  if (!layout.empty) {
    for (int& draw : layout.draw) draw = reader.Byte();
  }
  if (!reader.ok()) return refuse("is cut off");
  layout.coded = bytes.subspan(reader.position());
  return layout;
}

}  // namespace rilievo
