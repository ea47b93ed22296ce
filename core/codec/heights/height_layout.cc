#include "core/codec/heights/height_layout.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/pieces.h"

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
  AppendPieces(pieces, &payload);
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
  RILIEVO_ASSIGN_OR_RETURN(layout.pieces, ReadPieces(payload, reader.position(), group_count,
                                                     absl::StrCat("the groups of level ", level)));
  RILIEVO_RETURN_IF_ERROR(CheckLayout(layout.lifting, step, level));
  layout.step = static_cast<int32_t>(step);
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
  RILIEVO_ASSIGN_OR_RETURN(const std::span<const uint8_t> bytes,
                           CheckPiece(piece, absl::StrCat("group ", group, " of level ", level)));
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
