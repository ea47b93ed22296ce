// A surface with groups, some groups at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
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

// The bytes of item i of some, which depend on that item and on what was gathered before alone.
using MakeBytes =
    std::function<absl::StatusOr<std::vector<uint8_t>>(int i, const RunContext& context)>;
// The bytes of all `count` items in turn, wherever they are made.
using GatherBytes = std::function<absl::StatusOr<std::vector<std::vector<uint8_t>>>(
    int count, const MakeBytes& make, const RunContext& context)>;

// Several at once, each with one thread. The first error in their order is returned.
absl::StatusOr<std::vector<std::vector<uint8_t>>> MakeSeveral(int count, const MakeBytes& make,
                                                              const RunContext& context);

class EncodeBlocks {
 public:
  // All are kept by reference. `block_vertices`: of the finest level in a block, halo left out, as
  // far as groups are no larger. `gather`: what Gather() calls; empty: MakeSeveral().
  EncodeBlocks(const StoredSurface& surface, const PartCutter& cutter, const FaceGroups& groups,
               int64_t block_vertices, GatherBytes gather = {});

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

  // What make(block, context) finds of each range, in turn. It is sent as bytes: Found has
  // template <typename Archive, typename Self> static void Visit(Archive&, Self&), see
  // saved_value.h. The errors of `make` and of what gathers, INTERNAL for other bytes.
  template <typename Found, typename Make>
  absl::StatusOr<std::vector<Found>> Gather(const std::vector<GroupRange>& ranges,
                                            const RunContext& context, const Make& make) const {
    const auto bytes_of = [&](int i,
                              const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
      RILIEVO_ASSIGN_OR_RETURN(const GroupBlock block, Read(ranges[i], own));
      RILIEVO_ASSIGN_OR_RETURN(const Found found, make(block, own));
      ValueWriter writer;
      Found::Visit(writer, found);
      return std::move(writer.bytes);
    };
    RILIEVO_ASSIGN_OR_RETURN(auto bytes,
                             gather_(static_cast<int>(ranges.size()), bytes_of, context));
    std::vector<Found> all(ranges.size());
    for (size_t i = 0; i < all.size(); ++i) {
      ValueReader reader(bytes[i]);
      Found::Visit(reader, all[i]);
      if (!reader.Finished()) return NotOfBlock();
      bytes[i] = {};
    }
    return all;
  }
  // Of what was gathered and does not make sense.
  static absl::Status NotOfBlock();

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
  GatherBytes gather_;
  std::vector<int> owner_;  // of each vertex of the last shared level: its first face
};

}  // namespace rilievo
