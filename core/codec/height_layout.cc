#include "core/codec/height_layout.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/byte_stream.h"

namespace rilievo {

std::vector<uint8_t> WriteHeightLayout(const LiftingStep& lifting, const Dequantizer& dequantizer) {
  std::vector<uint8_t> payload;
  ByteWriter writer(payload);
  writer.Byte(static_cast<uint8_t>(lifting.rule * 16 + lifting.strength));
  writer.Varint(static_cast<uint64_t>(dequantizer.step));
  for (int draw : dequantizer.draw) writer.Byte(static_cast<uint8_t>(draw));
  return payload;
}

absl::StatusOr<HeightLayout> ReadHeightLayout(std::span<const uint8_t> payload, int level) {
  ByteReader reader(payload);
  HeightLayout layout;
  const int lifting = reader.Byte();
  const uint64_t step = reader.Varint();
  for (int& draw : layout.dequantizer.draw) draw = reader.Byte();
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
