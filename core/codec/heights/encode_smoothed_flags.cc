#include "core/codec/heights/encode_smoothed_flags.h"

#include <algorithm>
#include <memory>

#include "core/base/status_macros.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/pieces.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/holes.h"
#include "core/codec/heights/smoothed_flags.h"

namespace rilievo {
namespace {

// What the flags may take of a file, as one part in so many.
constexpr int64_t kSmoothedShare = 32, kMostSmoothedShare = 8;
constexpr int64_t kLargestPatch = 1024, kSmallShare = 16;  // at most a 16th of the heights

}  // namespace

std::vector<uint8_t> EncodeSmoothedOfGroup(const GroupMesh& mesh, const FaceVertices& numbers,
                                           const std::vector<int>& members, int max_level,
                                           const std::vector<uint8_t>& filled,
                                           const std::vector<uint8_t>& smoothed,
                                           const HeightModels& shared) {
  const std::vector<int> whole =
      VerticesThere(FaceVertices(mesh.refinement.levels[0], max_level), numbers, members);
  const std::vector<uint8_t> elsewhere = NotOfGroup(mesh, FlagsOfGroup(filled, whole));
  HeightState state;
  state.filled = FlagsOfGroup(smoothed, whole);
  const auto begin = static_cast<size_t>(mesh.refinement.vertex_count(kFirstGroupedLevel - 1));
  bool any = false;
  for (size_t v = begin; v < state.filled.size(); ++v) {
    if (elsewhere[v] != 0) state.filled[v] = 0;
    any = any || state.filled[v] != 0;
  }
  if (!any) return {};
  RangeEncoder coder;
  const auto models = std::make_unique<HeightModels>(shared);
  CodeSmoothedLevels(coder, mesh.refinement, kFirstGroupedLevel, max_level + 1, elsewhere, *models,
                     state);
  std::vector<uint8_t> piece = coder.Finish();
  if (piece.empty()) piece.push_back(0);  // all zeros, which were left off: not nothing
  return piece;
}

absl::StatusOr<std::vector<uint8_t>> EncodeSmoothed(const LoopRefinement& refinement, int max_level,
                                                    const FaceGroups* groups,
                                                    const std::vector<uint8_t>& filled,
                                                    const std::vector<uint8_t>& smoothed,
                                                    const RunContext& context) {
  const bool grouped = groups != nullptr && max_level >= kFirstGroupedLevel;
  const auto models = std::make_unique<HeightModels>();
  HeightState state;
  state.filled = smoothed;
  RangeEncoder coder;
  CodeSmoothedLevels(coder, refinement, 0, grouped ? kFirstGroupedLevel : max_level + 1, filled,
                     *models, state);
  const std::vector<uint8_t> shared = coder.Finish();
  if (!grouped) return shared;

  std::vector<std::vector<uint8_t>> pieces = {shared};
  const FaceVertices numbers(refinement.levels[0], max_level);
  RunContext one_thread = context;
  one_thread.threads = 1;
  one_thread.progress = nullptr;
  for (int g = 0; g < groups->count(); ++g) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const GroupMesh mesh, BuildGroupMesh(refinement.levels[0], *groups, g,
                                                                  max_level, one_thread));
    pieces.push_back(EncodeSmoothedOfGroup(mesh, numbers, groups->members[g], max_level, filled,
                                           smoothed, *models));
  }
  std::vector<uint8_t> payload;
  AppendPieces(pieces, &payload);
  return payload;
}

absl::StatusOr<EncodedFlags> ChooseSmoothedFlags(
    const SourceCounts& counts, int smallest, int64_t bytes, int64_t most,
    const std::function<absl::StatusOr<FlagsOfPatches>(int patch)>& flags_of) {
  EncodedFlags flags;
  if (counts.smoothed == 0) return flags;
  for (int64_t patch = smallest;; patch *= 4) {
    RILIEVO_ASSIGN_OR_RETURN(const FlagsOfPatches found, flags_of(static_cast<int>(patch)));
    flags.all = found.all;
    flags.chunk.clear();
    if (found.all || !found.any) return flags;
    flags.chunk = WrapChunk(kSmoothedTag, found.payload, false);
    const auto size = static_cast<int64_t>(flags.chunk.size());
    if (size <= std::min(bytes / kSmoothedShare, most)) return flags;
    if (4 * patch <= std::min(kLargestPatch, counts.known / kSmallShare)) continue;
    if (size <= std::min(bytes / kMostSmoothedShare, most)) return flags;
    flags.chunk.clear();
    flags.all = counts.smoothed > counts.measured;
    return flags;
  }
}

std::vector<uint8_t> NotMeasured(const std::vector<HeightSource>& sources,
                                 const std::vector<uint8_t>& filled) {
  std::vector<uint8_t> given(sources.size());
  for (size_t v = 0; v < given.size(); ++v) {
    given[v] = sources[v] != HeightSource::kMeasured && filled[v] == 0;
  }
  return given;
}

absl::StatusOr<EncodedFlags> EncodeSmoothedFlags(const DisplacedSurface& surface,
                                                 const LoopRefinement& refinement,
                                                 const std::vector<uint8_t>& filled,
                                                 const FaceGroups* groups, int smallest,
                                                 int64_t bytes, int64_t most,
                                                 const RunContext& context) {
  const std::vector<uint8_t> given = NotMeasured(surface.sources, filled);
  const SourceCounts counts = {
      std::count(surface.sources.begin(), surface.sources.end(), HeightSource::kSmoothed),
      std::count(surface.sources.begin(), surface.sources.end(), HeightSource::kMeasured),
      std::count(filled.begin(), filled.end(), 0)};
  const auto flags_of = [&](int patch) -> absl::StatusOr<FlagsOfPatches> {
    std::vector<uint8_t> smoothed = given;
    DropSmallPatches(refinement, surface.max_level, patch, filled, smoothed);
    const int64_t ones = std::count(smoothed.begin(), smoothed.end(), 1);
    FlagsOfPatches flags{ones > 0, ones > 0 && ones == counts.known, {}};
    if (!flags.any || flags.all) return flags;
    RILIEVO_ASSIGN_OR_RETURN(flags.payload, EncodeSmoothed(refinement, surface.max_level, groups,
                                                           filled, smoothed, context));
    return flags;
  };
  return ChooseSmoothedFlags(counts, smallest, bytes, most, flags_of);
}

}  // namespace rilievo
