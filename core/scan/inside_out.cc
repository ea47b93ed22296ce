#include "core/scan/inside_out.h"

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/parity_sets.h"
#include "core/scan/winding_number.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 64;
// Limbs may carry limbs.
constexpr int kMostRounds = 3;
// Half way from 0 to what it is on a surface seen from either side.
constexpr double kInsideOut = -0.25, kRight = 0.25;
// What a limb gains at least: all of it would be one.
constexpr double kLeastGain = 0.5;
// Share of the points where it must be right for the scan to count as closed.
constexpr double kClosed = 0.6;

class LimbSearch {
 public:
  LimbSearch(const OrientationPatches& patches, const std::vector<SignedLink>& links,
             OrientedCloud* cloud)
      : links_(links),
        cloud_(*cloud),
        members_(static_cast<size_t>(patches.count)),
        center_(Eigen::Matrix3Xd::Zero(3, patches.count)) {
    for (size_t i = 0; i < patches.patch.size(); ++i) {
      members_[patches.patch[i]].push_back(static_cast<int>(i));
      center_.col(patches.patch[i]) += cloud->points.col(static_cast<int64_t>(i));
    }
    for (size_t p = 0; p < members_.size(); ++p) {
      center_.col(static_cast<int64_t>(p)) /= static_cast<double>(members_[p].size());
    }
  }

  absl::Status Run(const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(Look(context, &winding_));
    for (int round = 0; round < kMostRounds && IsClosed(); ++round) {
      RILIEVO_ASSIGN_OR_RETURN(const bool turned, TurnLimbs(context));
      if (!turned) break;
    }
    return absl::OkStatus();
  }

 private:
  absl::Status Look(const RunContext& context, std::vector<double>* winding) const {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> all(cloud_.spacing.size());
    std::iota(all.begin(), all.end(), 0);
    const WindingField field(cloud_, std::move(all));
    winding->resize(members_.size());
    return ParallelFor(center_.cols(), kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) (*winding)[p] = field.At(center_.col(p));
    });
  }

  bool IsClosed() const {
    size_t right = 0;
    for (size_t p = 0; p < members_.size(); ++p) {
      if (winding_[p] > kRight) right += members_[p].size();
    }
    return static_cast<double>(right) > kClosed * static_cast<double>(cloud_.spacing.size());
  }

  std::vector<std::vector<int>> FindLimbs() const {
    ParitySets sets(static_cast<int>(members_.size()));
    for (const SignedLink& link : links_) {
      if (winding_[link.a] < 0 && winding_[link.b] < 0) sets.Join(link.a, link.b, 0);
    }
    std::vector<std::vector<int>> limbs(members_.size());
    for (int p = 0; p < static_cast<int>(members_.size()); ++p) {
      if (winding_[p] < 0) limbs[sets.Find(p)].push_back(p);
    }
    std::erase_if(limbs, [&](const std::vector<int>& limb) {
      return std::none_of(limb.begin(), limb.end(),
                          [&](int p) { return winding_[p] < kInsideOut; });
    });
    return limbs;
  }

  void Turn(const std::vector<int>& limb) {
    for (const int p : limb) {
      for (const int i : members_[p]) cloud_.normals.col(i) *= -1;
    }
  }

  // Over the points of a limb.
  double Mean(const std::vector<int>& limb, const std::vector<double>& winding) const {
    double sum = 0, points = 0;
    for (const int p : limb) {
      sum += winding[p] * static_cast<double>(members_[p].size());
      points += static_cast<double>(members_[p].size());
    }
    return sum / points;
  }

  // Turns all, and back those that are no better for it. Whether any stays turned.
  absl::StatusOr<bool> TurnLimbs(const RunContext& context) {
    const std::vector<std::vector<int>> limbs = FindLimbs();
    if (limbs.empty()) return false;
    for (const std::vector<int>& limb : limbs) Turn(limb);
    std::vector<double> turned;
    RILIEVO_RETURN_IF_ERROR(Look(context, &turned));
    bool any = false;
    for (const std::vector<int>& limb : limbs) {
      const double mean = Mean(limb, turned);
      if (mean > kRight && mean - Mean(limb, winding_) > kLeastGain) {
        any = true;
      } else {
        Turn(limb);
      }
    }
    if (any) RILIEVO_RETURN_IF_ERROR(Look(context, &winding_));
    return any;
  }

  const std::vector<SignedLink>& links_;
  OrientedCloud& cloud_;
  std::vector<std::vector<int>> members_;  // of each patch
  Eigen::Matrix3Xd center_;                // of each patch: noise off the surface averages out
  std::vector<double> winding_;            // at each centre
};

}  // namespace

absl::Status TurnInsideOut(const OrientationPatches& patches, const std::vector<SignedLink>& links,
                           OrientedCloud* cloud, const RunContext& context) {
  return LimbSearch(patches, links, cloud).Run(context);
}

}  // namespace rilievo
