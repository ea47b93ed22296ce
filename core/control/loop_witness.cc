#include "core/control/loop_witness.h"

#include <algorithm>

namespace rilievo {
namespace {

constexpr int kNearest = 8;
constexpr double kLeastPointsAround = 6;
constexpr double kAgreement = 0.9;  // mean cosine

}  // namespace

bool LoopWitness::Lines(std::span<const int> loop, const Eigen::Matrix3Xd& vertices,
                        const Eigen::Matrix3Xd& normals) const {
  double points_around = 0, agreement = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const int v = loop[i];
    int found[kNearest];
    double squared[kNearest];
    const int count =
        index_.Nearest(vertices.col(v), std::min(kNearest, index_.size()), found, squared);
    double best = -1;
    for (int k = 0; k < count; ++k) {
      best = std::max(best, cloud_.normals.col(found[k]).dot(normals.col(v)));
    }
    agreement += best;
    points_around += (vertices.col(loop[(i + 1) % loop.size()]) - vertices.col(v)).norm() /
                     cloud_.spacing[found[0]];
  }
  return points_around >= kLeastPointsAround &&
         agreement >= kAgreement * static_cast<double>(loop.size());
}

}  // namespace rilievo
