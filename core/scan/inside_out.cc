#include "core/scan/inside_out.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/parity_sets.h"
#include "core/scan/winding_number.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 64;
constexpr int kGroups = 128, kMostGroups = 512;
constexpr int64_t kRows = 1024;
constexpr int kFewestPatches = 4;  // of the largest group
constexpr double kOnSurface = 0.5;
constexpr double kMostOnSurface = 1;
// Off by less than this is right, by more than that is wrong.
constexpr double kRight = 0.25, kWrong = 0.5;
// Shares of the area: of what must be right for a scan to count as closed, and of what may be
// wrong.
constexpr double kClosed = 0.6, kNextToNothing = 2e-4;
// What a turned part gains at least, in squared winding numbers over its own area: a limb gains 1.
constexpr double kLeastGain = 0.25;

double Middle(const Eigen::VectorXd& values) {
  std::vector<double> sorted(values.begin(), values.end());
  const auto middle = sorted.begin() + static_cast<int64_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

class Turning {
 public:
  Turning(const OrientationPatches& patches, const std::vector<SignedLink>& agreements,
          OrientedCloud* cloud)
      : agreements_(agreements),
        cloud_(*cloud),
        members_(static_cast<size_t>(patches.count)),
        center_(Eigen::Matrix3Xd::Zero(3, patches.count)),
        area_(Eigen::VectorXd::Zero(patches.count)) {
    for (size_t i = 0; i < patches.patch.size(); ++i) {
      members_[patches.patch[i]].push_back(static_cast<int>(i));
      area_[patches.patch[i]] += cloud->spacing[i] * cloud->spacing[i];
    }
    for (int64_t p = 0; p < center_.cols(); ++p) {
      for (const int i : members_[p]) center_.col(p) += cloud->points.col(i);
      center_.col(p) /= static_cast<double>(members_[p].size());
    }
    area_ /= std::max(area_.sum(), 1e-300);
  }

  absl::Status Run(const RunContext& context) {
    if (area_.size() == 0) return absl::OkStatus();
    std::vector<int> all(cloud_.spacing.size());
    std::iota(all.begin(), all.end(), 0);
    Eigen::VectorXd winding(area_.size());
    const WindingField field(cloud_, std::move(all));
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(area_.size(), kBlock, context, [&](int64_t begin, int64_t end) {
          for (int64_t p = begin; p < end; ++p) winding[p] = field.At(center_.col(p));
        }));
    // Noise as thick as the spacing makes points seem sparser and their shares of the surface
    // larger.
    scale_ = kOnSurface / std::clamp(Middle(winding), kOnSurface, kMostOnSurface);
    winding *= scale_;
    const Eigen::ArrayXd off = (winding.array() - kOnSurface).abs();
    if ((off < kRight).select(area_, 0).sum() < kClosed) return absl::OkStatus();
    if ((off > kWrong).select(area_, 0).sum() < kNextToNothing) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(const bool made, MakeGroups(context));
    return made ? TurnGroups(context) : absl::OkStatus();
  }

 private:
  // Groups of patches that agree with each other, and what each adds to the winding number at each
  // patch. There may be too many of them to judge.
  absl::StatusOr<bool> MakeGroups(const RunContext& context) {
    const auto patches = static_cast<int>(area_.size());
    std::vector<SignedLink> agreeing;
    for (const SignedLink& link : agreements_) {
      if (link.weight > 0) agreeing.push_back(link);
    }
    RILIEVO_ASSIGN_OR_RETURN(
        group_,
        GrowGroups(patches, agreeing, std::max(kFewestPatches, patches / kGroups), context));
    const int groups = 1 + *std::max_element(group_.begin(), group_.end());
    if (groups > kMostGroups) return false;
    std::vector<std::vector<int>> points(static_cast<size_t>(groups));
    for (int p = 0; p < patches; ++p) {
      points[group_[p]].insert(points[group_[p]].end(), members_[p].begin(), members_[p].end());
    }
    std::vector<WindingField> fields;
    for (std::vector<int>& group : points) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      std::sort(group.begin(), group.end());
      fields.emplace_back(cloud_, std::move(group));
    }
    winding_.resize(patches, groups);
    RILIEVO_RETURN_IF_ERROR(ParallelFor(patches, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) {
        for (int g = 0; g < groups; ++g) {
          winding_(p, g) = static_cast<float>(scale_ * fields[g].At(center_.col(p)));
        }
      }
    }));
    return true;
  }

  // What is left to be desired under signs of the groups: the mean squared distance of the winding
  // number from one half.
  double Wrongness(const Eigen::VectorXf& signs) const {
    return area_.dot(((winding_ * signs).cast<double>().array() - kOnSurface).square().matrix());
  }

  // The pairwise form of the wrongness and of the votes, with a last group that never turns.
  absl::StatusOr<Eigen::MatrixXd> Weights(const RunContext& context) const {
    const int64_t groups = winding_.cols();
    Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(groups + 1, groups + 1);
    for (int64_t row = 0; row < winding_.rows(); row += kRows) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const int64_t rows = std::min(kRows, winding_.rows() - row);
      const Eigen::MatrixXd some = winding_.middleRows(row, rows).cast<double>();
      const Eigen::MatrixXd weighted = area_.segment(row, rows).asDiagonal() * some;
      weights.topLeftCorner(groups, groups) -= 2 * some.transpose() * weighted;
      weights.col(groups).head(groups) += 2 * kOnSurface * weighted.colwise().sum().transpose();
    }
    weights.row(groups).head(groups) = weights.col(groups).head(groups).transpose();
    double votes = 1e-300;
    for (const SignedLink& link : agreements_) votes += std::abs(link.weight);
    for (const SignedLink& link : agreements_) {
      const int a = group_[link.a], b = group_[link.b];
      weights(a, b) += link.weight / votes;
      weights(b, a) += link.weight / votes;
    }
    weights.diagonal().setZero();
    return weights;
  }

  absl::Status TurnGroups(const RunContext& context) {
    const int64_t groups = winding_.cols();
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::MatrixXd weights, Weights(context));
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::VectorXd best, BestSigns(weights, context));
    const Eigen::VectorXf signs = (best.head(groups) * best[groups]).cast<float>();
    // Turned groups that touch are one part.
    ParitySets parts(static_cast<int>(groups));
    for (const SignedLink& link : agreements_) {
      const int a = group_[link.a], b = group_[link.b];
      if (a != b && signs[a] < 0 && signs[b] < 0) parts.Join(a, b, 0);
    }
    Eigen::VectorXf turned = Eigen::VectorXf::Ones(groups);
    double wrongness = Wrongness(turned);
    for (int head = 0; head < groups; ++head) {
      if (signs[head] > 0 || parts.Find(head) != head) continue;
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      Eigen::VectorXf with = turned;
      double area = 0;
      for (int64_t p = 0; p < area_.size(); ++p) {
        const int group = group_[p];
        if (signs[group] > 0 || parts.Find(group) != head) continue;
        with[group] = -1;
        area += area_[p];
      }
      const double left = Wrongness(with);
      if (wrongness - left < kLeastGain * area) continue;
      turned = with;
      wrongness = left;
    }
    for (int64_t p = 0; p < area_.size(); ++p) {
      if (turned[group_[p]] > 0) continue;
      for (const int i : members_[p]) cloud_.normals.col(i) *= -1;
    }
    return absl::OkStatus();
  }

  const std::vector<SignedLink>& agreements_;
  OrientedCloud& cloud_;
  std::vector<std::vector<int>> members_;  // of each patch
  Eigen::Matrix3Xd center_;                // of each patch: noise off the surface averages out
  Eigen::VectorXd area_;                   // of each patch, all together 1
  std::vector<int> group_;                 // of each patch
  double scale_ = 1;                       // of winding numbers
  Eigen::MatrixXf winding_;                // row: patch, column: what that group adds there
};

}  // namespace

absl::Status TurnInsideOut(const OrientationPatches& patches,
                           const std::vector<SignedLink>& agreements, OrientedCloud* cloud,
                           const RunContext& context) {
  return Turning(patches, agreements, cloud).Run(context);
}

}  // namespace rilievo
