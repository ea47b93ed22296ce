#include "core/codec/heights/encode_blocks.h"

#include <algorithm>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/heights/height_decoder.h"
#include "core/loop/face_vertices.h"

namespace rilievo {
namespace {

constexpr int kSharedLevel = kFirstGroupedLevel - 1;

std::vector<int> FirstFaces(const MeshTopology& control) {
  std::vector<int> first(control.vertex_count + control.edge_count());
  for (int f = control.face_count() - 1; f >= 0; --f) {
    for (int k = 0; k < 3; ++k) {
      first[control.faces(k, f)] = f;
      first[control.vertex_count + control.face_edges(k, f)] = f;
    }
  }
  return first;
}

// The groups of some faces. `there` becomes the number of each in the whole.
FaceGroups GroupsOf(const std::vector<int>& faces, const FaceGroups& whole,
                    std::vector<int>* there) {
  FaceGroups groups;
  *there = {};
  for (const int f : faces) there->push_back(whole.group_of[f]);
  std::sort(there->begin(), there->end());
  there->erase(std::unique(there->begin(), there->end()), there->end());
  groups.members.resize(there->size());
  for (size_t i = 0; i < faces.size(); ++i) {
    const auto at = std::lower_bound(there->begin(), there->end(), whole.group_of[faces[i]]);
    const auto group = static_cast<int>(at - there->begin());
    groups.group_of.push_back(group);
    groups.place_of.push_back(static_cast<int>(groups.members[group].size()));
    groups.members[group].push_back(static_cast<int>(i));
  }
  return groups;
}

// Calls work(i, one_thread) for each, several at once. The first error in their order is returned.
template <typename Work>
absl::Status ForEachOf(size_t count, const RunContext& context, const Work& work) {
  RunContext one_thread = context;
  one_thread.threads = 1;
  one_thread.progress = nullptr;
  std::vector<absl::Status> ended(count);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(count), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) ended[i] = work(static_cast<size_t>(i), one_thread);
      }));
  for (absl::Status& status : ended) RILIEVO_RETURN_IF_ERROR(status);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::vector<std::vector<uint8_t>>> MakeSeveral(int count, const MakeBytes& make,
                                                              const RunContext& context) {
  std::vector<std::vector<uint8_t>> all(static_cast<size_t>(count));
  RILIEVO_RETURN_IF_ERROR(
      ForEachOf(all.size(), context, [&](size_t i, const RunContext& one_thread) -> absl::Status {
        RILIEVO_ASSIGN_OR_RETURN(all[i], make(static_cast<int>(i), one_thread));
        return absl::OkStatus();
      }));
  return all;
}

EncodeBlocks::EncodeBlocks(const StoredSurface& surface, const PartCutter& cutter,
                           const FaceGroups& groups, int64_t block_vertices, GatherBytes gather)
    : surface_(surface),
      cutter_(cutter),
      groups_(groups),
      gather_(gather ? std::move(gather) : MakeSeveral),
      owner_(FirstFaces(cutter.topology())) {
  shared_.levels.push_back(cutter.topology());
  const int64_t vertices = VertexCountAt(cutter.topology(), surface.max_level);
  const int64_t most = block_vertices * cutter.topology().face_count() / vertices;  // faces
  int64_t faces = 0;
  for (int g = 0; g < groups.count(); ++g) {
    const auto more = static_cast<int64_t>(groups.members[g].size());
    if (ranges_.empty() || faces + more > most) {
      ranges_.push_back({g, g});
      faces = 0;
    }
    ranges_.back().last = g + 1;
    faces += more;
  }
}

std::vector<GroupRange> EncodeBlocks::Samples(int most) const {
  const int count = std::min(most, groups_.count());
  std::vector<GroupRange> samples;
  for (int i = 0; i < count; ++i) {
    const auto group = static_cast<int>(int64_t{i} * groups_.count() / count);
    samples.push_back({group, group + 1});
  }
  return samples;
}

absl::StatusOr<GroupBlock> EncodeBlocks::Read(const GroupRange& range,
                                              const RunContext& context) const {
  GroupBlock block;
  block.range = range;
  std::vector<int> faces;
  for (int g = range.first; g < range.last; ++g) {
    faces.insert(faces.end(), groups_.members[g].begin(), groups_.members[g].end());
  }
  std::sort(faces.begin(), faces.end());
  // One ring more comes with them.
  RILIEVO_ASSIGN_OR_RETURN(block.part, ReadPart(surface_, cutter_, faces, kHeightReach - 1));
  // Heights are coded over the connectivity alone.
  ControlMesh smooth{
      block.part.surface.control_mesh.vertices, block.part.surface.control_mesh.faces, {}, {}};
  RILIEVO_ASSIGN_OR_RETURN(block.refinement,
                           RefineTopology(smooth, surface_.max_level - 1, context));
  block.groups = GroupsOf(block.part.faces, groups_, &block.group_there);
  block.coarse_there =
      VerticesThere(FaceVertices(block.refinement.levels[0], kSharedLevel),
                    FaceVertices(cutter_.topology(), kSharedLevel), block.part.faces);
  return block;
}

absl::Status EncodeBlocks::ForEach(
    const std::vector<GroupRange>& ranges, const RunContext& context,
    const std::function<absl::Status(size_t i, const GroupBlock& block,
                                     const RunContext& one_thread)>& visit) const {
  return ForEachOf(ranges.size(), context,
                   [&](size_t i, const RunContext& one_thread) -> absl::Status {
                     RILIEVO_ASSIGN_OR_RETURN(const GroupBlock block, Read(ranges[i], one_thread));
                     return visit(i, block, one_thread);
                   });
}

absl::Status EncodeBlocks::NotOfBlock() {
  return absl::InternalError("what was kept of a block of groups is not what was coded of it");
}

}  // namespace rilievo
