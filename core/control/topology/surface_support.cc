#include "core/control/topology/surface_support.h"

#include <algorithm>
#include <limits>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/topology/settings.h"
#include "core/points/batched_nearest.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

// What the points around a place on the surface say of it.
class SupportSum {
 public:
  SupportSum(const Eigen::Vector3d& position, const Eigen::Vector3d& normal)
      : position_(position), normal_(normal) {}

  // A point in reach whose normal agrees.
  void Add(const Eigen::Vector3d& point) {
    const Eigen::Vector3d offset = point - position_;
    const Eigen::Vector3d aside = offset - normal_ * normal_.dot(offset);
    sum_ += aside;
    nearest_ = std::min(nearest_, aside.norm());
    farthest_ = std::max(farthest_, aside.norm());
    ++count_;
  }

  bool empty() const { return count_ == 0; }

  // Whether all points lie to one side, farther off than points are from each other: beyond the
  // border of a scan.
  bool BeyondBorder(double spacing) const {
    return nearest_ > kSurfaceSupport.nearest_spacings * spacing &&
           sum_.norm() > kSurfaceSupport.one_sided * count_ * farthest_;
  }

 private:
  const Eigen::Vector3d position_, normal_;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();
  double nearest_ = std::numeric_limits<double>::infinity(), farthest_ = 0;
  int count_ = 0;
};

}  // namespace

absl::StatusOr<SurfaceSupport> FindSupport(const Eigen::Matrix3Xd& places,
                                           const Eigen::Matrix3Xd& normals,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const RunContext& context) {
  const int64_t count = places.cols();
  SurfaceSupport support{std::vector<uint8_t>(count, 0), std::vector<float>(count, 0.0f)};
  const int n = std::min(kCommon.near_points, index.size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kLightBlock, context, [&](int64_t begin, int64_t end) {
    BatchedNearest nearby(index, cloud.points, n);
    const auto judge = [&](int64_t v, const int* found, const double* squared) {
      support.spacing[v] = cloud.spacing[found[0]];
      SupportSum sum(places.col(v), normals.col(v));
      for (int i = 0; i < n; ++i) {
        const double reach = std::max(kSurfaceSupport.support_spacings * cloud.spacing[found[i]],
                                      kSurfaceSupport.support_noises * cloud.noise[found[i]]);
        if (squared[i] <= reach * reach &&
            cloud.normals.col(found[i]).dot(normals.col(v)) > kSurfaceSupport.support_agreement) {
          sum.Add(cloud.points.col(found[i]));
        }
      }
      support.holds[v] = !sum.empty() && !sum.BeyondBorder(support.spacing[v]);
    };
    nearby.OfEach(places, begin, end, judge);
  }));
  return support;
}

}  // namespace rilievo
