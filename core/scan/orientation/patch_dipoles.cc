#include "core/scan/orientation/patch_dipoles.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

#include "core/base/status_macros.h"
#include "core/points/belonging.h"

namespace rilievo {
namespace {

// Of 274 joins of groups whose links contradict each other, in simulated streets, blocks, rooms and
// machined parts, the sum of the votes' balance and so many times the agreement was right but for
// 13 to 16 (of 8 to 15 times), the votes alone but for 86, the agreement alone but for 24.
constexpr double kWorth = 10;
// A closed group has none, but for what its points are apart.
constexpr double kLeastAgreement = 0.05;
// How far around a group, in its radii, another one counts.
constexpr double kReach = 8;

}  // namespace

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
  for (int p = 0; p < patches.count; ++p) {
    sums_[p] = SumOfDipoles(cloud, MembersOf(p), [this](int i) { return DipoleOfPoint(i); });
  }
}

// With the sign of its patch.
Dipole PatchDipoles::DipoleOfPoint(int point) const {
  Dipole dipole = DipoleOf(cloud_, point);
  if (patches_.parity[point] != 0) dipole.area = -dipole.area;
  return dipole;
}

double PatchDipoles::Between(int a, int b, Scratch* scratch) const {
  if (AreFar(sums_[a], sums_[b])) return rilievo::Agreement(sums_[a].sum, sums_[b].sum);
  for (const auto& [patch, points] : {std::pair(a, &(*scratch)[0]), std::pair(b, &(*scratch)[1])}) {
    points->clear();
    for (const int i : MembersOf(patch)) points->push_back(DipoleOfPoint(i));
  }
  return rilievo::Agreement(std::span<const Dipole>((*scratch)[0]), (*scratch)[1]);
}

absl::StatusOr<double> PatchDipoles::Agreement(std::span<const SignedNode> a,
                                               std::span<const SignedNode> b,
                                               const RunContext& context) const {
  const auto size_of = [this](std::span<const SignedNode> group) {
    double size = 0;
    for (const SignedNode& node : group) size += sums_[node.node].size;
    return size;
  };
  double size = size_of(a);
  if (const double other = size_of(b); other < size) {
    std::swap(a, b);
    size = other;
  }
  if (!(size > 0)) return 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  int points = 0;
  for (const SignedNode& node : a) {
    center += sums_[node.node].size / size * sums_[node.node].sum.position;
    points += begin_[node.node + 1] - begin_[node.node];
  }
  if (points < kFewestOfPlane) return 0;
  double radius = 0;
  for (const SignedNode& node : a) {
    const DipoleSum& patch = sums_[node.node];
    radius = std::max(radius, (patch.sum.position - center).norm() + patch.radius);
  }
  double sum = 0;
  Scratch scratch;
  for (const SignedNode& there : b) {
    const DipoleSum& patch = sums_[there.node];
    const double reach = kReach * radius + patch.radius;
    if ((patch.sum.position - center).squaredNorm() > reach * reach) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    for (const SignedNode& here : a) {
      sum += here.sign * there.sign * Between(here.node, there.node, &scratch);
    }
  }
  const double agreement = sum / size * std::sqrt(size / std::numbers::pi);
  return std::abs(agreement) >= kLeastAgreement ? kWorth * agreement : 0;
}

}  // namespace rilievo
