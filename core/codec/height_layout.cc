#include "core/codec/height_layout.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/byte_stream.h"

namespace rilievo {
namespace {

constexpr int kEmptyFlag = 128;  // of the first byte, over rule * 16 + strength

}  // namespace

std::vector<uint8_t> WriteHeightLayout(const HeightLayout& layout) {
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  const int lifting = layout.lifting.rule * 16 + layout.lifting.strength;
  writer.Byte(static_cast<uint8_t>(lifting | (layout.empty ? kEmptyFlag : 0)));
  if (layout.empty) return payload;
  writer.Varint(static_cast<uint64_t>(layout.dequantizer.step));
  for (int draw : layout.dequantizer.draw) writer.Byte(static_cast<uint8_t>(draw));
  return payload;
}

absl::StatusOr<HeightLayout> ReadHeightLayout(std::span<const uint8_t> payload, int level) {
  ByteReader reader(payload);
  HeightLayout layout;
  const int first = reader.Byte(), lifting = first & ~kEmptyFlag;
  layout.empty = (first & kEmptyFlag) != 0;
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
  if (layout.lifting.rule >= static_cast<int>(kEdgeRules.size()) || step < 1 ||
      step > kMaxHeightStep) {
    return absl::DataLossError(absl::StrCat("the layer of level ", level, " names rule ",
                                            layout.lifting.rule, " and step ", step,
                                            ": the format has neither"));
  }
  layout.dequantizer.step = static_cast<int32_t>(step);
  layout.coded = payload.subspan(reader.position());
  return layout;
}

}  // namespace rilievo
