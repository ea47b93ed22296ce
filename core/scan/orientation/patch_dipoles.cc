#include "core/scan/orientation/patch_dipoles.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/orientation/outward_sign.h"
#include "core/scan/orientation/settings.h"

namespace rilievo {

PatchDipoles::PatchDipoles(const OrientationPatches& patches, const OrientedCloud& cloud)
    : patches_(patches),
      cloud_(cloud),
      sums_(static_cast<size_t>(patches.count)),
      begin_(sums_.size() + 1, 0),
      members_(patches.patch.size()) {
  for (const int patch : patches.patch) ++begin_[patch + 1];
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<int> next(begin_.begin(), begin_.end() - 1);
  for (size_t i = 0; i < members_.size(); ++i) {
    members_[next[patches.patch[i]]++] = static_cast<int>(i);
  }
  const auto dipole_of = [this](int i) { return DipoleOfPoint(i); };
  first_leaf_.reserve(begin_.size());
  for (int p = 0; p < patches.count; ++p) {
    sums_[p] = SumOfDipoles(cloud, MembersOf(p), dipole_of);
    first_leaf_.push_back(static_cast<int>(leaves_.size()));
    for (int begin = begin_[p]; begin < begin_[p + 1]; begin += kPatchDipoles.leaf) {
      const int end = std::min(begin + kPatchDipoles.leaf, begin_[p + 1]);
      const std::span points(members_.data() + begin, members_.data() + end);
      leaves_.push_back({SumOfDipoles(cloud, points, dipole_of), begin, end});
    }
  }
  first_leaf_.push_back(static_cast<int>(leaves_.size()));
}

// With the sign of its patch.
Dipole PatchDipoles::DipoleOfPoint(int point) const {
  Dipole dipole = DipoleOf(cloud_, point);
  if (patches_.parity[point] != 0) dipole.area = -dipole.area;
  return dipole;
}

double PatchDipoles::Between(const Leaf& a, const Leaf& b) const {
  if (AreFar(a.all, b.all)) return rilievo::Agreement(a.all.sum, b.all.sum);
  std::array<Dipole, kPatchDipoles.leaf> there;
  for (int m = b.begin; m < b.end; ++m) there[m - b.begin] = DipoleOfPoint(members_[m]);
  double sum = 0;
  for (int m = a.begin; m < a.end; ++m) {
    const Dipole here = DipoleOfPoint(members_[m]);
    for (int n = 0; n < b.end - b.begin; ++n) sum += rilievo::Agreement(here, there[n]);
  }
  return sum;
}

double PatchDipoles::Between(int a, int b) const {
  if (AreFar(sums_[a], sums_[b])) return rilievo::Agreement(sums_[a].sum, sums_[b].sum);
  double sum = 0;
  for (const Leaf& here : LeavesOf(a)) {
    for (const Leaf& there : LeavesOf(b)) sum += Between(here, there);
  }
  return sum;
}

double PatchDipoles::SizeOf(std::span<const SignedNode> group) const {
  double size = 0;
  for (const SignedNode& node : group) size += sums_[node.node].size;
  return size;
}

// Its points in the order of the cloud, as a WindingField takes them, with normals by its signs.
OrientedCloud PatchDipoles::CloudOf(std::span<const SignedNode> group) const {
  std::vector<std::pair<int, int>> signs;  // by point
  for (const SignedNode& node : group) {
    for (const int i : MembersOf(node.node)) {
      signs.emplace_back(i, patches_.parity[i] != 0 ? -node.sign : node.sign);
    }
  }
  std::sort(signs.begin(), signs.end());
  OrientedCloud cloud;
  cloud.points.resize(3, static_cast<Eigen::Index>(signs.size()));
  cloud.normals.resize(3, cloud.points.cols());
  for (Eigen::Index to = 0; to < cloud.points.cols(); ++to) {
    const auto& [i, sign] = signs[to];
    cloud.points.col(to) = cloud_.points.col(i);
    cloud.normals.col(to) = sign * cloud_.normals.col(i);
    cloud.spacing.push_back(cloud_.spacing[i]);
    cloud.noise.push_back(cloud_.noise[i]);
  }
  return cloud;
}

absl::StatusOr<std::optional<double>> PatchDipoles::Relation(double balance,
                                                             std::span<const SignedNode> a,
                                                             std::span<const SignedNode> b,
                                                             const RunContext& context) const {
  if (SizeOf(b) < SizeOf(a)) std::swap(a, b);
  int points = 0;
  for (const SignedNode& node : a) points += static_cast<int>(MembersOf(node.node).size());
  if (points < kCommon.fewest_of_plane) return balance;
  RILIEVO_ASSIGN_OR_RETURN(const double agreement, Agreement(a, b, context));
  const double both = balance + kPatchDipoles.worth * agreement;
  if (std::abs(both) > kSignedGraph.sure_balance) return both;
  const OrientedCloud alone = CloudOf(a);
  std::vector<int> all(alone.spacing.size());
  std::iota(all.begin(), all.end(), 0);
  if (OwnOutwardSign(alone, all) != 0) return std::nullopt;
  return both;
}

absl::StatusOr<double> PatchDipoles::Agreement(std::span<const SignedNode> a,
                                               std::span<const SignedNode> b,
                                               const RunContext& context) const {
  const double size = SizeOf(a);
  if (!(size > 0)) return 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const SignedNode& node : a) {
    center += sums_[node.node].size / size * sums_[node.node].sum.position;
  }
  double radius = 0;
  for (const SignedNode& node : a) {
    const DipoleSum& patch = sums_[node.node];
    radius = std::max(radius, (patch.sum.position - center).norm() + patch.radius);
  }
  double sum = 0;
  for (const SignedNode& there : b) {
    const DipoleSum& patch = sums_[there.node];
    const double reach = kPatchDipoles.reach * radius + patch.radius;
    if ((patch.sum.position - center).squaredNorm() > reach * reach) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    for (const SignedNode& here : a) {
      sum += here.sign * there.sign * Between(here.node, there.node);
    }
  }
  return sum / size * std::sqrt(size / std::numbers::pi);
}

}  // namespace rilievo
