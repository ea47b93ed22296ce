#include "core/codec/container/height_update.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/container/deformed_surface.h"
#include "core/codec/container/dss_metadata.h"
#include "core/codec/heights/height_decoder.h"

namespace rilievo {
namespace {

using Span = std::span<const uint8_t>;

struct UpdateLayout {
  DssMetadata metadata;
  double unit = 0;
  bool all_smoothed = false;
  std::vector<Span> layers;  // of each level
  std::optional<Span> smoothed, filled;
};

absl::StatusOr<UpdateLayout> ReadUpdate(const OpenedDss& file, const Chunk& chunk) {
  constexpr int kKnownFlags = kAllSmoothedFlag | kTellsSmoothedFlag | kTellsFilledFlag;
  constexpr double kMostUnit = 0.011;  // as of the heights themselves
  ByteReader reader(chunk.payload);
  UpdateLayout update;
  const int flags = reader.Byte();
  ByteReader fields(reader.Bytes(reader.Varint()));
  update.metadata = ReadMetadata(fields);
  update.unit = reader.ShortF64();
  for (int level = 0; level <= file.header.max_level; ++level) {
    update.layers.push_back(reader.Bytes(reader.Varint()));
  }
  update.all_smoothed = (flags & kAllSmoothedFlag) != 0;
  if ((flags & kTellsSmoothedFlag) != 0) update.smoothed = reader.Bytes(reader.Varint());
  if ((flags & kTellsFilledFlag) != 0) update.filled = reader.Bytes(reader.Varint());
  if (!reader.ok() || reader.remaining() > 0 || !fields.ok()) {
    return absl::DataLossError(
        absl::StrCat("chunk ", chunk.number, " is not as long as the update in it"));
  }
  if ((flags & ~kKnownFlags) != 0 || !(update.unit > 0 && update.unit <= kMostUnit)) {
    return absl::DataLossError(absl::StrCat("the update of chunk ", chunk.number,
                                            " has unknown flags, ", flags, ", or no unit, ",
                                            update.unit));
  }
  return update;
}

// `decode`: the layers with one kind of flags.
template <typename Decode>
absl::StatusOr<std::vector<float>> ApplyEach(const OpenedDss& file, const Decode& decode,
                                             std::vector<float>* heights,
                                             std::vector<HeightSource>* sources) {
  std::vector<float> changes;
  for (const Chunk& chunk : file.updates) {
    RILIEVO_ASSIGN_OR_RETURN(const UpdateLayout update, ReadUpdate(file, chunk));
    RILIEVO_ASSIGN_OR_RETURN(DecodedHeights told, decode(update.layers, update.smoothed));
    std::vector<uint8_t> is_filled(told.heights.size(), 0);
    if (update.filled) {
      RILIEVO_ASSIGN_OR_RETURN(DecodedHeights again, decode(update.layers, update.filled));
      is_filled = std::move(again.smoothed);
    }
    // What counts as filled among the differences is not told anew.
    const std::vector<HeightSource> anew = told.Sources(update.all_smoothed);
    changes.assign(anew.size(), 0.0f);
    for (size_t v = 0; v < anew.size(); ++v) {
      if (anew[v] == HeightSource::kFilled) continue;
      const double change = told.heights[v] * update.unit;
      changes[v] = static_cast<float>(change);
      (*heights)[v] = static_cast<float>((*heights)[v] + change);
      (*sources)[v] = is_filled[v] != 0 ? HeightSource::kFilled : anew[v];
    }
  }
  return changes;
}

}  // namespace

absl::StatusOr<std::vector<float>> ApplyUpdates(const OpenedDss& file,
                                                const LoopRefinement& refinement,
                                                const RunContext& context,
                                                std::vector<float>* heights,
                                                std::vector<HeightSource>* sources) {
  const FaceGroups* groups = file.header.group_limit > 0 ? &file.groups : nullptr;
  const auto decode = [&](const std::vector<Span>& layers, const std::optional<Span>& flags) {
    return DecodeHeightLayers(layers, {}, refinement, groups, true, flags, context);
  };
  return ApplyEach(file, decode, heights, sources);
}

absl::Status ApplyUpdatesToPart(const OpenedDss& file, const LoopRefinement& shared,
                                const std::vector<int>& part, const LoopRefinement& refinement,
                                const RunContext& context, std::vector<float>* heights,
                                std::vector<HeightSource>* sources) {
  const auto decode = [&](const std::vector<Span>& layers,
                          const std::optional<Span>& flags) -> absl::StatusOr<DecodedHeights> {
    RILIEVO_ASSIGN_OR_RETURN(const PartHeights changes,
                             PartHeights::Open(layers, shared, file.groups, true, flags, context));
    return changes.Decode(part, refinement, context);
  };
  return ApplyEach(file, decode, heights, sources).status();
}

absl::StatusOr<DssMetadata> MetadataWithUpdates(const OpenedDss& file) {
  if (file.updates.empty()) return file.header.metadata;
  RILIEVO_ASSIGN_OR_RETURN(const UpdateLayout last, ReadUpdate(file, file.updates.back()));
  DssMetadata metadata = OfAnotherShape(file.header.metadata);
  if (!last.metadata.generator.empty()) metadata.generator = last.metadata.generator;
  metadata.measured_share = last.metadata.measured_share;
  metadata.smoothed_share = last.metadata.smoothed_share;
  metadata.filled_share = last.metadata.filled_share;
  return metadata;
}

}  // namespace rilievo
