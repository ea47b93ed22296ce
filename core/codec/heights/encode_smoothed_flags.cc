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

// One piece of the groups' payload, empty where the group has no smoothed height to code.
std::vector<uint8_t> EncodeGroup(const GroupMesh& mesh, const FaceVertices& whole_numbers,
                                 const std::vector<int>& members, int max_level,
                                 const std::vector<uint8_t>& filled,
                                 const std::vector<uint8_t>& smoothed, const HeightModels& shared) {
  const std::vector<int> whole =
      VerticesThere(FaceVertices(mesh.refinement.levels[0], max_level), whole_numbers, members);
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

}  // namespace

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
    pieces.push_back(
        EncodeGroup(mesh, numbers, groups->members[g], max_level, filled, smoothed, *models));
  }
  std::vector<uint8_t> payload;
  AppendPieces(pieces, &payload);
  return payload;
}

absl::StatusOr<EncodedFlags> EncodeSmoothedFlags(const DisplacedSurface& surface,
                                                 const LoopRefinement& refinement,
                                                 const std::vector<uint8_t>& filled,
                                                 const FaceGroups* groups, int smallest,
                                                 int64_t bytes, int64_t most,
                                                 const RunContext& context) {
  // Small holes count as what is around them.
  std::vector<uint8_t> given(surface.sources.size());
  int64_t smoothed_count = 0, measured_count = 0;
  for (size_t v = 0; v < given.size(); ++v) {
    smoothed_count += surface.sources[v] == HeightSource::kSmoothed;
    measured_count += surface.sources[v] == HeightSource::kMeasured;
    given[v] = surface.sources[v] != HeightSource::kMeasured && filled[v] == 0;
  }
  EncodedFlags flags;
  if (smoothed_count == 0) return flags;
  const int64_t known = std::count(filled.begin(), filled.end(), 0);
  for (int64_t patch = smallest;; patch *= 4) {
    std::vector<uint8_t> smoothed = given;
    DropSmallPatches(refinement, surface.max_level, static_cast<int>(patch), filled, smoothed);
    const int64_t ones = std::count(smoothed.begin(), smoothed.end(), 1);
    flags.all = ones > 0 && ones == known;
    flags.chunk.clear();
    if (flags.all || ones == 0) return flags;
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<uint8_t> payload,
        EncodeSmoothed(refinement, surface.max_level, groups, filled, smoothed, context));
    flags.chunk = WrapChunk(kSmoothedTag, payload, false);
    const auto size = static_cast<int64_t>(flags.chunk.size());
    if (size <= std::min(bytes / kSmoothedShare, most)) return flags;
    if (4 * patch <= std::min(kLargestPatch, known / kSmallShare)) continue;
    if (size <= std::min(bytes / kMostSmoothedShare, most)) return flags;
    flags.chunk.clear();
    flags.all = smoothed_count > measured_count;
    return flags;
  }
}

}  // namespace rilievo
