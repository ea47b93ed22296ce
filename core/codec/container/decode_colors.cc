#include <algorithm>
#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/container/colors.h"
#include "core/codec/heights/height_decoder.h"

namespace rilievo {
namespace {

constexpr size_t kChannels = 3;
using Payloads = std::vector<std::span<const uint8_t>>;

// By channel, those of the first `levels` levels.
absl::StatusOr<std::array<Payloads, kChannels>> PayloadsOf(const OpenedDss& file, size_t levels) {
  if (!file.header.metadata.colors.is_known()) {
    return absl::DataLossError("there are colours, but chunk 0 does not say what they stand for");
  }
  std::array<Payloads, kChannels> payloads;
  for (size_t level = 0; level < levels; ++level) {
    ByteReader reader(file.colors[level].payload);
    for (Payloads& channel : payloads) channel.push_back(reader.Bytes(reader.Varint()));
    if (reader.ok()) continue;
    return absl::DataLossError(absl::StrCat("chunk ", file.colors[level].number,
                                            " ends within the colours of level ", level));
  }
  return payloads;
}

// `decode`: the values of a channel in its units, by its payloads.
template <typename Decode>
absl::StatusOr<std::vector<Rgb>> Decoded(const OpenedDss& file, size_t levels,
                                         const Decode& decode) {
  RILIEVO_ASSIGN_OR_RETURN(const auto payloads, PayloadsOf(file, levels));
  std::array<std::vector<int32_t>, kChannels> values;
  for (size_t k = 0; k < kChannels; ++k) {
    RILIEVO_ASSIGN_OR_RETURN(DecodedHeights channel, decode(payloads[k]));
    values[k] = std::move(channel.heights);
  }
  const ColorDecoder decoder(file.header.metadata.colors);
  std::vector<Rgb> colors;
  colors.reserve(values[0].size());
  for (size_t v = 0; v < values[0].size(); ++v) {
    colors.push_back(decoder.ColorOf({values[0][v], values[1][v], values[2][v]}));
  }
  return colors;
}

}  // namespace

absl::StatusOr<std::vector<Rgb>> DecodeColors(const OpenedDss& file,
                                              const LoopRefinement& refinement,
                                              const RunContext& context) {
  const int levels = std::min(static_cast<int>(file.colors.size()), file.level_count());
  if (levels == 0) return std::vector<Rgb>();
  const FaceGroups* groups = file.header.group_limit > 0 ? &file.groups : nullptr;
  RILIEVO_ASSIGN_OR_RETURN(
      std::vector<Rgb> colors,
      Decoded(file, static_cast<size_t>(levels), [&](const Payloads& payloads) {
        return DecodeHeightLayers(payloads, {}, refinement, groups, false, std::nullopt, context);
      }));
  for (int level = levels; level < file.level_count(); ++level) {
    AppendMeanColors(refinement.levels[level - 1], &colors);
  }
  return colors;
}

absl::StatusOr<std::vector<Rgb>> DecodePartOfColors(const OpenedDss& file,
                                                    const LoopRefinement& shared,
                                                    const std::vector<int>& part,
                                                    const LoopRefinement& refinement,
                                                    const RunContext& context) {
  const auto decode = [&](const Payloads& payloads) -> absl::StatusOr<DecodedHeights> {
    RILIEVO_ASSIGN_OR_RETURN(
        const PartHeights channel,
        PartHeights::Open(payloads, shared, file.groups, false, std::nullopt, context));
    return channel.Decode(part, refinement, context);
  };
  return Decoded(file, file.layers.size(), decode);
}

}  // namespace rilievo
