// How patches of a scan agree through the winding number.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/dipole.h"
#include "core/scan/orientation/orientation_patches.h"
#include "core/scan/orientation/signed_graph.h"

namespace rilievo {

// Points count as dipoles (Barill et al. 2018). Two of them agree by as much as the winding number
// of the one falls along the other; the sum over all pairs is largest where the surface has no rims
// but its own, closed or open (orientation by winding numbers: Xu et al. 2023).
class PatchDipoles {
 public:
  // Both are kept by reference.
  PatchDipoles(const OrientationPatches& patches, const OrientedCloud& cloud);

  // A GroupRelation: how much the votes and the agreement say together; the votes alone where the
  // smaller group has only a few points. None where that leaves it open and the smaller group shows
  // by itself which side of it is outside.
  absl::StatusOr<std::optional<double>> Relation(double balance, std::span<const SignedNode> a,
                                                 std::span<const SignedNode> b,
                                                 const RunContext& context) const;

 private:
  // By how much two groups of patches agree, per area of the smaller one, `a`, and times the radius
  // of a disc as large. Of the larger one what lies within four radii of the smaller one counts.
  absl::StatusOr<double> Agreement(std::span<const SignedNode> a, std::span<const SignedNode> b,
                                   const RunContext& context) const;
  double SizeOf(std::span<const SignedNode> group) const;
  OrientedCloud CloudOf(std::span<const SignedNode> group) const;
  // Some points of a patch that follow each other along the Morton curve.
  struct Leaf {
    DipoleSum all;
    int begin, end;  // in `members_`
  };
  double Between(int a, int b) const;
  double Between(const Leaf& a, const Leaf& b) const;
  Dipole DipoleOfPoint(int point) const;
  std::span<const int> MembersOf(int patch) const {
    return {members_.data() + begin_[patch], members_.data() + begin_[patch + 1]};
  }
  std::span<const Leaf> LeavesOf(int patch) const {
    return {leaves_.data() + first_leaf_[patch], leaves_.data() + first_leaf_[patch + 1]};
  }

  const OrientationPatches& patches_;
  const OrientedCloud& cloud_;
  std::vector<DipoleSum> sums_;
  std::vector<int> begin_;    // by patch, in `members_`
  std::vector<int> members_;  // points
  std::vector<Leaf> leaves_;
  std::vector<int> first_leaf_;  // by patch, in `leaves_`
};

}  // namespace rilievo
