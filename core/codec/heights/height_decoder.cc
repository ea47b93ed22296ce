#include "core/codec/heights/height_decoder.h"

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/group_heights.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/heights/height_range.h"
#include "core/codec/heights/smoothed_flags.h"

namespace rilievo {
namespace {

// Levels [0, count), each for the whole surface.
absl::Status DecodeWholeLevels(std::span<const std::span<const uint8_t>> layers,
                               const LoopRefinement& refinement, bool has_filled,
                               const RunContext& context, HeightModels& models,
                               HeightState& state) {
  NoChoice chooser;
  for (int level = 0; level < static_cast<int>(layers.size()); ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const HeightLayout layout, ReadHeightLayout(layers[level], level));
    RangeDecoder coder(layout.coded);
    LevelCoder<RangeDecoder, NoChoice> coded(coder, chooser, refinement, level,
                                             layout.dequantizer.step, has_filled, models, state);
    if (!coded.Run(layout.empty) ||
        !AddValues(layout.dequantizer, state.coefficients, state.heights)) {
      return HeightOutOfRange();
    }
    if (coder.overrun()) {
      return absl::DataLossError(
          absl::StrCat("the heights of level ", level, " end before their last one"));
    }
    if (level > 0) {
      SynthesizeLevel(refinement.levels[level - 1], layout.lifting, state.heights);
      if (!InHeightRange(state.heights)) return HeightOutOfRange();
    }
  }
  return absl::OkStatus();
}

// A level without coefficients on the edges of `topology`.
void AddPlainLevel(const MeshTopology& topology, int rule, HeightState& state) {
  for (int e = 0; e < topology.edge_count(); ++e) {
    const EdgeStencil stencil = StencilOfEdge(topology, e);
    const bool filled = state.filled[stencil.ends[0]] != 0 && state.filled[stencil.ends[1]] != 0;
    state.filled.push_back(filled ? 1 : 0);
  }
  state.heights.resize(state.filled.size(), 0);
  LiftingStep lifting;
  lifting.rule = rule;
  lifting.strength = 0;
  SynthesizeLevel(topology, lifting, state.heights);
}

// The groups' own part of the levels from kFirstGroupedLevel on.
struct GroupReader {
  const MeshTopology& control;
  const FaceGroups& groups;
  const std::vector<GroupedLayout>& levels;
  const HeightModels& models;
  const HeightState& shared;
  const SmoothedReader* smoothed;  // null: not said
  bool has_filled;

  int max_level() const { return kFirstGroupedLevel + static_cast<int>(levels.size()) - 1; }

  // Puts what the group codes at the vertices of `there`, its finest level's, into `result`.
  // `shared_numbers`: of the whole's vertices of the last shared level. `face_there`: for
  // each member its face there or -1.
  absl::Status Read(int group, const FaceVertices& shared_numbers, const FaceVertices& there,
                    const std::vector<int>& face_there, DecodedHeights& result) const {
    RunContext one_thread;
    one_thread.threads = 1;
    RILIEVO_ASSIGN_OR_RETURN(const GroupMesh mesh,
                             BuildGroupMesh(control, groups, group, max_level(), one_thread));
    const MeshTopology& own = mesh.refinement.levels[0];
    const std::vector<int>& members = groups.members[group];
    const std::vector<int> whole =
        VerticesThere(FaceVertices(own, kFirstGroupedLevel - 1), shared_numbers, members);
    RILIEVO_ASSIGN_OR_RETURN(
        const GroupHeights decoded,
        DecodeGroup(mesh, levels, has_filled, models, StateOfGroup(shared, members, whole)));
    std::vector<uint8_t> smoothed_here;
    if (smoothed != nullptr) {
      RILIEVO_ASSIGN_OR_RETURN(smoothed_here,
                               smoothed->ReadGroup(mesh, max_level(), whole, decoded.filled));
    }
    const std::vector<int> target =
        VerticesThere(FaceVertices(own, max_level()), there, face_there);
    for (size_t v = whole.size(); v < target.size(); ++v) {
      if (target[v] < 0 || mesh.foreign[v] != 0) continue;
      result.heights[target[v]] = decoded.values[v];
      result.filled[target[v]] = decoded.filled[v];
      if (smoothed != nullptr) result.smoothed[target[v]] = smoothed_here[v];
    }
    return absl::OkStatus();
  }
};

absl::StatusOr<std::vector<GroupedLayout>> ReadGroupedLayouts(
    const std::vector<std::span<const uint8_t>>& layers, int group_count) {
  std::vector<GroupedLayout> levels;
  for (size_t level = kFirstGroupedLevel; level < layers.size(); ++level) {
    RILIEVO_ASSIGN_OR_RETURN(
        GroupedLayout layout,
        ReadGroupedLayout(layers[level], static_cast<int>(level), group_count));
    levels.push_back(std::move(layout));
  }
  return levels;
}

// What the values of coefficients behind the heights of level kFirstGroupedLevel - 1 make of
// heights beyond the range: the whole has none; at the rim of a part, where neighbours are missing,
// there may be some, and nothing that was asked for depends on them.
enum class BeyondRange { kRefuse, kClamp };
absl::Status SynthesizeLevels(const LoopRefinement& refinement,
                              const std::vector<GroupedLayout>& levels, BeyondRange beyond,
                              std::vector<int32_t>& heights) {
  for (size_t i = 0; i < levels.size(); ++i) {
    const int level = kFirstGroupedLevel + static_cast<int>(i);
    const std::span<int32_t> reached =
        std::span(heights).first(static_cast<size_t>(refinement.vertex_count(level)));
    SynthesizeLevel(refinement.levels[level - 1], levels[i].lifting, reached);
    if (beyond == BeyondRange::kClamp) {
      for (int32_t& height : reached) {
        height = std::clamp(height, -kMaxHeightUnits, kMaxHeightUnits);
      }
    } else if (!InHeightRange(reached)) {
      return HeightOutOfRange();
    }
  }
  return absl::OkStatus();
}

// A group to be read, and for each of its members its face in the mesh whose heights are wanted, or
// -1.
struct WantedGroup {
  int group;
  std::vector<int> face_there;
};

// What all groups share, and the heights of a mesh that is the whole or a part of it.
struct GroupedHeights {
  const LoopRefinement& refinement;      // of the mesh
  const std::vector<int>& whole_vertex;  // of each vertex of level kFirstGroupedLevel - 1
  const std::vector<WantedGroup>& wanted;
  BeyondRange beyond;

  absl::StatusOr<DecodedHeights> Decode(const GroupReader& reader,
                                        const RunContext& context) const {
    const int max_level = reader.max_level();
    DecodedHeights decoded;
    decoded.heights.resize(refinement.vertex_count(max_level), 0);
    decoded.filled.resize(decoded.heights.size(), 0);
    if (reader.smoothed != nullptr) decoded.smoothed.resize(decoded.heights.size(), 0);
    for (size_t v = 0; v < whole_vertex.size(); ++v) {
      decoded.heights[v] = reader.shared.heights[whole_vertex[v]];
      decoded.filled[v] = reader.shared.filled[whole_vertex[v]];
      if (reader.smoothed != nullptr) {
        decoded.smoothed[v] = reader.smoothed->shared()[whole_vertex[v]];
      }
    }
    const FaceVertices shared_numbers(reader.control, kFirstGroupedLevel - 1),
        numbers(refinement.levels[0], max_level);
    std::vector<absl::Status> statuses(wanted.size());
    // Each group writes at vertices of its own.
    RILIEVO_RETURN_IF_ERROR(ParallelFor(
        static_cast<int64_t>(wanted.size()), 1, context, [&](int64_t begin, int64_t end) {
          for (int64_t i = begin; i < end; ++i) {
            statuses[i] = reader.Read(wanted[i].group, shared_numbers, numbers,
                                      wanted[i].face_there, decoded);
          }
        }));
    for (const absl::Status& status : statuses) RILIEVO_RETURN_IF_ERROR(status);
    RILIEVO_RETURN_IF_ERROR(SynthesizeLevels(refinement, reader.levels, beyond, decoded.heights));
    return decoded;
  }
};

// Null where the file has no such chunk. `filled`: of the first `level_count` levels.
absl::StatusOr<std::unique_ptr<SmoothedReader>> ReadSmoothed(
    const std::optional<std::span<const uint8_t>>& payload, const LoopRefinement& refinement,
    int level_count, int group_count, const std::vector<uint8_t>& filled) {
  if (!payload) return nullptr;
  RILIEVO_ASSIGN_OR_RETURN(SmoothedReader opened, SmoothedReader::Open(*payload, group_count));
  auto reader = std::make_unique<SmoothedReader>(std::move(opened));
  RILIEVO_RETURN_IF_ERROR(reader->ReadShared(refinement, level_count, filled));
  return reader;
}

}  // namespace

std::vector<HeightSource> DecodedHeights::Sources(bool all_smoothed) const {
  std::vector<HeightSource> sources;
  sources.reserve(filled.size());
  for (size_t v = 0; v < filled.size(); ++v) {
    const bool is_smoothed = all_smoothed || (!smoothed.empty() && smoothed[v] != 0);
    sources.push_back(filled[v] != 0 ? HeightSource::kFilled
                      : is_smoothed  ? HeightSource::kSmoothed
                                     : HeightSource::kMeasured);
  }
  return sources;
}

absl::StatusOr<DecodedHeights> DecodeHeightLayers(
    const std::vector<std::span<const uint8_t>>& layers, std::span<const uint8_t> plain,
    const LoopRefinement& refinement, const FaceGroups* groups, bool has_filled,
    const std::optional<std::span<const uint8_t>>& smoothed, const RunContext& context) {
  const bool grouped = groups != nullptr && layers.size() > kFirstGroupedLevel;
  HeightState state;
  const auto models = std::make_unique<HeightModels>();
  const std::span all(layers);
  RILIEVO_RETURN_IF_ERROR(DecodeWholeLevels(grouped ? all.first(kFirstGroupedLevel) : all,
                                            refinement, has_filled, context, *models, state));
  for (size_t i = 0; i < plain.size(); ++i) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    AddPlainLevel(refinement.levels[layers.size() + i - 1], plain[i], state);
    if (!InHeightRange(state.heights)) return HeightOutOfRange();
  }
  const int level_count = static_cast<int>(layers.size() + plain.size());
  RILIEVO_ASSIGN_OR_RETURN(
      const std::unique_ptr<SmoothedReader> flags,
      ReadSmoothed(smoothed, refinement, grouped ? kFirstGroupedLevel : level_count,
                   grouped ? groups->count() : 0, state.filled));
  if (!grouped) {
    return DecodedHeights{std::move(state.heights), std::move(state.filled),
                          flags != nullptr ? flags->shared() : std::vector<uint8_t>()};
  }

  RILIEVO_ASSIGN_OR_RETURN(const std::vector<GroupedLayout> levels,
                           ReadGroupedLayouts(layers, groups->count()));
  std::vector<int> itself(state.heights.size());
  std::iota(itself.begin(), itself.end(), 0);
  std::vector<WantedGroup> wanted;
  for (int g = 0; g < groups->count(); ++g) wanted.push_back({g, groups->members[g]});
  return GroupedHeights{refinement, itself, wanted, BeyondRange::kRefuse}.Decode(
      GroupReader{refinement.levels[0], *groups, levels, *models, state, flags.get(), has_filled},
      context);
}

absl::StatusOr<PartHeights> PartHeights::Open(
    const std::vector<std::span<const uint8_t>>& layers, const LoopRefinement& shared,
    const FaceGroups& groups, bool has_filled,
    const std::optional<std::span<const uint8_t>>& smoothed, const RunContext& context) {
  PartHeights opened(shared.levels[0], groups, has_filled);
  RILIEVO_RETURN_IF_ERROR(DecodeWholeLevels(std::span(layers).first(kFirstGroupedLevel), shared,
                                            has_filled, context, *opened.models_, opened.state_));
  RILIEVO_ASSIGN_OR_RETURN(opened.flags_, ReadSmoothed(smoothed, shared, kFirstGroupedLevel,
                                                       groups.count(), opened.state_.filled));
  RILIEVO_ASSIGN_OR_RETURN(opened.levels_, ReadGroupedLayouts(layers, groups.count()));
  return opened;
}

absl::StatusOr<DecodedHeights> PartHeights::Decode(const std::vector<int>& part,
                                                   const LoopRefinement& refinement,
                                                   const RunContext& context) const {
  const std::vector<int> whole =
      VerticesThere(FaceVertices(refinement.levels[0], kFirstGroupedLevel - 1),
                    FaceVertices(control_, kFirstGroupedLevel - 1), part);
  std::map<int, std::vector<int>> face_there;
  for (size_t i = 0; i < part.size(); ++i) {
    const int group = groups_.group_of[part[i]];
    std::vector<int>& there = face_there[group];
    there.resize(groups_.members[group].size(), -1);
    there[groups_.place_of[part[i]]] = static_cast<int>(i);
  }
  std::vector<WantedGroup> wanted;
  for (auto& [group, there] : face_there) wanted.push_back({group, std::move(there)});
  return GroupedHeights{refinement, whole, wanted, BeyondRange::kClamp}.Decode(
      GroupReader{control_, groups_, levels_, *models_, state_, flags_.get(), has_filled_},
      context);
}

}  // namespace rilievo
