#include "core/base/xp.h"
#include "core/scan/orientation/outward_sign.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {
namespace {

constexpr int kDirections = 64;
constexpr int64_t kReachesPerTask = 1 << 18;  // points times directions
constexpr double kGoldenAngle = 2.399963229728653;

// Evenly spread over the sphere, in opposite pairs.
Eigen::Vector3d Direction(int index) {
  constexpr int kHalf = kDirections / 2;
  const int i = index % kHalf;
  const double z = 1 - (i + 0.5) / kHalf;
  const double r = std::sqrt(1 - z * z);
  const Eigen::Vector3d direction(r * std::cos(i * kGoldenAngle), r * std::sin(i * kGoldenAngle),
                                  z);
  return index < kHalf ? direction : Eigen::Vector3d(-direction);
}

// In [-1, 1]: the normals at the extreme points of all directions against those directions, the
// sum over the sum of magnitudes.
double ExtremeVote(const OrientedCloud& cloud, std::span<const int> members,
                   const RunContext& context) {
  std::array<double, kDirections> cosines{};
  const int64_t directions = kReachesPerTask / static_cast<int64_t>(members.size());
  ParallelFor(kDirections, std::max<int64_t>(1, directions), context,
              [&](int64_t begin, int64_t end) {
                for (int64_t d = begin; d < end; ++d) {
                  const Eigen::Vector3d direction = Direction(static_cast<int>(d));
                  int extreme = members.front();
                  double furthest = direction.dot(cloud.points.col(extreme));
                  for (const int i : members) {
                    const double reach = direction.dot(cloud.points.col(i));
                    if (reach <= furthest) continue;
                    furthest = reach;
                    extreme = i;
                  }
                  cosines[static_cast<size_t>(d)] = direction.dot(cloud.normals.col(extreme));
                }
              })
      .IgnoreError();
  double vote = 0, total = 0;
  for (const double cosine : cosines) {
    vote += cosine;
    total += std::abs(cosine);
  }
  return total > 0 ? vote / total : 0;
}

}  // namespace

int OutwardSign(const OrientedCloud& cloud, std::span<const int> members,
                const RunContext& context) {
  constexpr double kClosed = 0.5;
  constexpr double kConvex = 0.2;
  const double vote = ExtremeVote(cloud, members, context);
  if (!XP("volume") && !XP("wind") && std::abs(vote) > kClosed) return vote < 0 ? -1 : 1;

  // Each point stands for spacing^2 of surface.
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), area = Eigen::Vector3d::Zero();
  double weight = 0;
  for (const int i : members) {
    const double share = cloud.spacing[i] * cloud.spacing[i];
    center += share * cloud.points.col(i);
    area += share * cloud.normals.col(i);
    weight += share;
  }
  if (weight > 0) center /= weight;
  double volume = 0, lever = 0;
  for (const int i : members) {
    const double share = cloud.spacing[i] * cloud.spacing[i];
    const Eigen::Vector3d arm = cloud.points.col(i) - center;
    volume += share * arm.dot(cloud.normals.col(i));
    lever += share * arm.norm();
  }
  double mean = 0, skew = 0;
  if (XP("dump") || XP("wind")) {
    const WindingField field(cloud, std::vector<int>(members.begin(), members.end()));
    double all = 0;
    const size_t stride = std::max<size_t>(1, members.size() / 512);
    for (size_t m = 0; m < members.size(); m += stride) {
      const int i = members[m];
      const double share = cloud.spacing[i] * cloud.spacing[i];
      const double w = field.At(cloud.points.col(i));
      mean += share * w; all += share; skew += share * std::abs(w);
    }
    mean /= all; skew /= all;
  }
  if (XP("dump")) {
    std::fprintf(stderr, "outward n %zu vote %.3f vol/lever %.3f area/size %.3f xyz %.3f %.3f %.3f winding %.3f abs %.3f\n", members.size(), vote, volume / lever, area.norm() / weight, area.x() / weight, area.y() / weight, area.z() / weight, mean, skew);
  }
  if (XP("wind")) {
    if (std::abs(mean) > XPN("CLOSED", 0.3)) return mean < 0 ? -1 : 1;
    if (std::abs(volume) > XPN("CONVEX", 0.4) * lever) return volume < 0 ? -1 : 1;
  } else if (XP("volume")) {
    if (area.norm() < XPN("CLOSED", 0.1) * weight || std::abs(volume) > XPN("CONVEX", 0.4) * lever) return volume < 0 ? -1 : 1;
  } else
  if (std::abs(volume) > kConvex * lever) return volume < 0 ? -1 : 1;
  for (const int axis : {2, 1, 0}) {
    if (std::abs(area[axis]) > 0.3 * area.norm()) return area[axis] < 0 ? -1 : 1;
  }
  return 1;
}

}  // namespace rilievo
