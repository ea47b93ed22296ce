#include "core/codec/container/encode_update.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/dss_metadata.h"
#include "core/codec/container/height_update.h"
#include "core/codec/heights/encode_smoothed_flags.h"
#include "core/codec/heights/height_encoder.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

absl::Status CheckUpdate(const DisplacedSurface& before, const HeightUpdate& update) {
  constexpr float kMostHeight = 0.5F;
  const size_t count = before.heights.size();
  if (update.told.size() != count || update.heights.size() != count ||
      update.sources.size() != count) {
    return absl::InvalidArgumentError(
        absl::StrCat("there are ", update.told.size(), " flags, ", update.heights.size(),
                     " heights and ", update.sources.size(), " sources for ", count, " vertices"));
  }
  if (!(update.step > 0 && update.step <= kMaxStep)) {
    return absl::InvalidArgumentError(
        absl::StrCat("step is ", update.step, ", must be in (0, ", kMaxStep, "]"));
  }
  for (size_t v = 0; v < count; ++v) {
    if (update.told[v] != 0 && !(std::abs(update.heights[v]) <= kMostHeight)) {
      return absl::InvalidArgumentError(
          absl::StrCat("height ", v, " is ", update.heights[v], ", must be within ", kMostHeight));
    }
  }
  return absl::OkStatus();
}

// The differences as heights of their own, of which those that are not told count as filled.
DisplacedSurface DifferencesOf(const DisplacedSurface& before, const HeightUpdate& update) {
  DisplacedSurface field;
  field.frame = before.frame;
  field.control_mesh = before.control_mesh;
  field.max_level = before.max_level;
  field.heights.resize(update.told.size(), 0.0F);
  field.sources.resize(update.told.size(), HeightSource::kFilled);
  for (size_t v = 0; v < update.told.size(); ++v) {
    if (update.told[v] == 0) continue;
    field.heights[v] = update.heights[v] - before.heights[v];
    field.sources[v] = HeightSource::kMeasured;
  }
  return field;
}

// What the file says of all sources once this one is in it.
DssMetadata SharesAfter(const DisplacedSurface& before, const HeightUpdate& update) {
  std::array<double, 3> counts = {0, 0, 0};
  for (size_t v = 0; v < update.told.size(); ++v) {
    const HeightSource source = update.told[v] != 0 ? update.sources[v] : before.sources[v];
    ++counts[static_cast<size_t>(source)];
  }
  const auto share = [&](HeightSource source) {
    return counts[static_cast<size_t>(source)] / static_cast<double>(update.told.size());
  };
  DssMetadata metadata;
  metadata.generator = update.generator;
  metadata.measured_share = share(HeightSource::kMeasured);
  metadata.smoothed_share = share(HeightSource::kSmoothed);
  metadata.filled_share = share(HeightSource::kFilled);
  return metadata;
}

// Flags among the heights that are told; none: without bytes.
struct SourceFlags {
  std::vector<uint8_t> flags;
  int64_t count = 0;
};
SourceFlags FlagsOf(HeightSource source, const HeightUpdate& update) {
  SourceFlags found;
  for (size_t v = 0; v < update.told.size(); ++v) {
    found.flags.push_back(update.told[v] != 0 && update.sources[v] == source);
    found.count += found.flags.back();
  }
  return found;
}

std::vector<uint8_t> PayloadOf(int flags, const DssMetadata& metadata,
                               const EncodedHeights& heights,
                               const std::vector<std::vector<uint8_t>>& kinds) {
  std::vector<uint8_t> fields, payload;
  ByteWriter inner(fields);
  WriteMetadata(metadata, inner);
  ByteWriter writer(payload);
  const auto put = [&](const std::vector<uint8_t>& bytes) {
    writer.Varint(bytes.size());
    writer.Bytes(bytes);
  };
  writer.Byte(static_cast<uint8_t>(flags));
  put(fields);
  writer.ShortF64(heights.unit);
  for (const std::vector<uint8_t>& layer : heights.layers) put(layer);
  for (const std::vector<uint8_t>& kind : kinds) put(kind);
  return payload;
}

}  // namespace

absl::Status CheckUpdatedFile(const OpenedDss& file) {
  if (file.version < 3) {
    return absl::FailedPreconditionError(
        absl::StrCat("the file is of format version ", file.version,
                     "; only those of version 3 and on take updates"));
  }
  if (!file.whole()) {
    return absl::FailedPreconditionError(
        absl::StrCat("the file ends at level ", static_cast<int>(file.layers.size()) - 1, " of ",
                     file.header.max_level, "; an update needs all of them"));
  }
  if (file.updates.size() < kMostUpdates) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat("the file has ", file.updates.size(),
                   " updates, and the format no more; reconstruct the surface anew"));
}

absl::StatusOr<std::vector<uint8_t>> EncodeUpdate(std::span<const uint8_t> dss,
                                                  const DisplacedSurface& before,
                                                  const HeightUpdate& update,
                                                  const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, /*check_groups=*/true));
  RILIEVO_RETURN_IF_ERROR(CheckUpdatedFile(file));
  RILIEVO_RETURN_IF_ERROR(CheckUpdate(before, update));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(before.control_mesh, std::max(0, before.max_level - 1), context));
  const DisplacedSurface field = DifferencesOf(before, update);
  constexpr int kKeepAll = 1;  // no patch of few vertices takes on what is around it
  // Also where every height is told, for its decoder expects flags.
  HeightPlan plan;
  plan.has_filled = true;
  const FaceGroups* groups = file.header.group_limit > 0 ? &file.groups : nullptr;
  const HeightEncoder encoder(field, refinement, kKeepAll, groups, &plan);
  RILIEVO_ASSIGN_OR_RETURN(const EncodedHeights heights, encoder.Encode(update.step, context));
  const std::vector<uint8_t>& untold = encoder.filled();
  const int64_t told = std::count(untold.begin(), untold.end(), 0);
  const SourceFlags smoothed = FlagsOf(HeightSource::kSmoothed, update);
  const SourceFlags filled = FlagsOf(HeightSource::kFilled, update);
  const bool all_smoothed = smoothed.count > 0 && smoothed.count + filled.count == told;
  int flags = all_smoothed ? kAllSmoothedFlag : 0;
  std::vector<std::vector<uint8_t>> kinds;
  const auto add = [&](const SourceFlags& kind, int flag) -> absl::Status {
    flags |= flag;
    RILIEVO_ASSIGN_OR_RETURN(
        kinds.emplace_back(),
        EncodeSmoothed(refinement, before.max_level, groups, untold, kind.flags, context));
    return absl::OkStatus();
  };
  if (smoothed.count > 0 && !all_smoothed) {
    RILIEVO_RETURN_IF_ERROR(add(smoothed, kTellsSmoothedFlag));
  }
  if (filled.count > 0) RILIEVO_RETURN_IF_ERROR(add(filled, kTellsFilledFlag));
  return WrapChunk(kUpdateTag, PayloadOf(flags, SharesAfter(before, update), heights, kinds),
                   false);
}

}  // namespace rilievo
