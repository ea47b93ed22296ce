#include "core/registration/match_scans.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kLeastCosine = 0.5;
// Along the surface, in spacings of the scan that is asked: within it all but 2 % of the places
// inside of a scan have a point.
constexpr double kWithinSpacings = 1;

// The match of `asked`, a point of scan a, in b; false without one.
struct Asker {
  const ScanSample& a;
  const ScanSample& b;
  const Pose& a_pose;
  const Pose& b_pose;
  const Pose b_from_a;
  double reach;
  double most_along = kWithinSpacings * *std::max_element(b.spacing.begin(), b.spacing.end());

  bool Ask(Eigen::Index point, ScanMatch* match) const {
    int nearest = 0;
    double squared = 0;
    const Vector3d asked = b_from_a * a.points.col(point);
    if (b.index.Nearest(asked, 1, &nearest, &squared, reach * reach + most_along * most_along) ==
        0) {
      return false;
    }
    const double along = kWithinSpacings * b.spacing[nearest];
    if (squared > reach * reach + along * along) return false;
    const Vector3d own_normal = b_from_a.linear() * a.normals.col(point);
    const Vector3d found_normal = b.normals.col(nearest);
    if (own_normal.dot(found_normal) < kLeastCosine) return false;
    const Vector3d normal = (own_normal + found_normal).normalized();
    const double across = normal.dot(asked - b.points.col(nearest));
    if (std::abs(across) > reach || squared - across * across > along * along) return false;
    *match = {a_pose * a.points.col(point), b_pose * b.points.col(nearest),
              b_pose.linear() * normal};
    return true;
  }

  // Returns the share of those asked that have a match.
  double AskAll(int64_t most_points, bool swap, std::vector<ScanMatch>* matches) const {
    const int64_t count = a.points.cols(), asked = std::min(count, most_points);
    const size_t before = matches->size();
    for (int64_t i = 0; i < asked; ++i) {
      ScanMatch match;
      if (!Ask(i * count / asked, &match)) continue;
      if (swap) std::swap(match.first, match.second);
      matches->push_back(match);
    }
    return static_cast<double>(matches->size() - before) / static_cast<double>(asked);
  }
};

}  // namespace

ScanMatches FindMatches(const ScanSample& first, const Pose& first_pose, const ScanSample& second,
                        const Pose& second_pose, double reach, int64_t most_points) {
  const Pose second_from_first = second_pose.inverse() * first_pose;
  ScanMatches found;
  found.share_of_first =
      Asker{first, second, first_pose, second_pose, second_from_first, reach}.AskAll(
          most_points, false, &found.matches);
  found.share_of_second =
      Asker{second, first, second_pose, first_pose, second_from_first.inverse(), reach}.AskAll(
          most_points, true, &found.matches);
  return found;
}

double SpreadOf(const std::vector<ScanMatch>& matches) {
  constexpr double kOfGaussian = 1.4826;
  if (matches.empty()) return 0;
  std::vector<double> distances;
  distances.reserve(matches.size());
  for (const ScanMatch& match : matches) distances.push_back(std::abs(match.Distance()));
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return kOfGaussian * *middle;
}

}  // namespace rilievo
