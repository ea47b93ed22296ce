// A surface with groups, some groups at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/refinement.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// Groups that follow each other, [first, last).
struct GroupRange {
  int first = 0, last = 0;
};

// The faces of a range and those that their coefficients depend on.
struct GroupBlock {
  GroupRange range;
  SurfacePart part;
  LoopRefinement refinement;      // of the part, up to the last level but one
  FaceGroups groups;              // of the part's faces, in the order of the whole's groups
  std::vector<int> group_there;   // of each of them, the whole's
  std::vector<int> coarse_there;  // of each of the part's vertices at the last shared level
};

class EncodeBlocks {
 public:
  // All are kept by reference. `block_vertices`: of the finest level in a block, halo left out, as
  // far as groups are no larger.
  EncodeBlocks(const StoredSurface& surface, const PartCutter& cutter, const FaceGroups& groups,
               int64_t block_vertices);

  const StoredSurface& surface() const { return surface_; }
  const FaceGroups& groups() const { return groups_; }
  // The control mesh alone.
  const LoopRefinement& shared() const { return shared_; }
  int shared_count() const { return shared_.vertex_count(kFirstGroupedLevel - 1); }

  // All groups, in blocks.
  const std::vector<GroupRange>& ranges() const { return ranges_; }
  // Single groups, spread evenly: at most `most`.
  std::vector<GroupRange> Samples(int most) const;

  // Calls visit(i, block) for each range, several at once; what it writes must be its own. The
  // first error in the order of the ranges is returned.
  absl::Status ForEach(
      const std::vector<GroupRange>& ranges, const RunContext& context,
      const std::function<absl::Status(size_t i, const GroupBlock& block,
                                       const RunContext& one_thread)>& visit) const;

  // Whether this range decides of a vertex of the last shared level of the whole.
  bool Owns(const GroupRange& range, int shared_vertex) const {
    const int group = groups_.group_of[owner_[shared_vertex]];
    return group >= range.first && group < range.last;
  }

 private:
  absl::StatusOr<GroupBlock> Read(const GroupRange& range, const RunContext& context) const;

  const StoredSurface& surface_;
  const PartCutter& cutter_;
  const FaceGroups& groups_;
  LoopRefinement shared_;
  std::vector<GroupRange> ranges_;
  std::vector<int> owner_;  // of each vertex of the last shared level: its first face
};

}  // namespace rilievo
