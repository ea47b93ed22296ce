#include "core/scan/orientation/inverted_components.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/signed_union_find.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 64;
// Limbs may carry limbs, or have bores.
constexpr int kMostRounds = 3;
// The winding number on a part that is inside out is off by one from what it is on most of the
// scan: less on a limb, more on the wall of a bore. By how much a patch is off at least to be of
// such a part, and all of it in the mean; by how much at most when it has been turned.
constexpr double kWrong = 0.5, kInsideOut = 0.75, kRight = 0.25;
// Where it is this at least on this share of the points, the scan counts as closed.
constexpr double kEnclosed = 0.25, kClosed = 0.6;

class PartSearch {
 public:
  PartSearch(const OrientationPatches& patches, const std::vector<SignedLink>& links,
             OrientedCloud* cloud)
      : links_(links), cloud_(*cloud), members_(static_cast<size_t>(patches.count)) {
    for (size_t i = 0; i < patches.patch.size(); ++i) {
      members_[patches.patch[i]].push_back(static_cast<int>(i));
    }
  }

  absl::Status Run(const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(Look(context, &winding_));
    usual_ = Usual();
    for (int round = 0; round < kMostRounds && IsClosed(); ++round) {
      RILIEVO_ASSIGN_OR_RETURN(const bool turned, TurnParts(context));
      if (!turned) break;
    }
    return absl::OkStatus();
  }

 private:
  // At a few points of a patch: its centre is within the body where that is round, outside of it in
  // a hollow.
  double MeanWinding(const std::vector<int>& members, const WindingField& field) const {
    constexpr size_t kMostSamples = 4;
    const size_t count = std::min(kMostSamples, members.size());
    std::array<Eigen::Vector3d, kMostSamples> samples;
    for (size_t i = 0; i < count; ++i) {
      samples[i] = cloud_.points.col(members[i * members.size() / count]);
    }
    return field.MeanAt({samples.data(), count});
  }

  absl::Status Look(const RunContext& context, std::vector<double>* winding) const {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> all(cloud_.spacing.size());
    std::iota(all.begin(), all.end(), 0);
    const WindingField field(cloud_, std::move(all));
    winding->resize(members_.size());
    const auto count = static_cast<int64_t>(members_.size());
    return ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) (*winding)[p] = MeanWinding(members_[p], field);
    });
  }

  // The median over the points: one half on a clean closed scan, up to nine tenths under noise.
  double Usual() const {
    std::vector<int> patches(members_.size());
    std::iota(patches.begin(), patches.end(), 0);
    std::sort(patches.begin(), patches.end(),
              [&](int p, int q) { return winding_[p] < winding_[q]; });
    size_t below = 0;
    for (const int p : patches) {
      below += members_[p].size();
      if (2 * below >= cloud_.spacing.size()) return winding_[p];
    }
    return 0;
  }

  bool IsClosed() const {
    size_t right = 0;
    for (size_t p = 0; p < members_.size(); ++p) {
      if (winding_[p] > kEnclosed) right += members_[p].size();
    }
    return static_cast<double>(right) > kClosed * static_cast<double>(cloud_.spacing.size());
  }

  // -1: the winding number is one of a limb that is inside out, 1: of the wall of a bore, 0:
  // neither.
  int WrongWay(int patch) const {
    const double off = winding_[patch] - usual_;
    return off < -kWrong ? -1 : off > kWrong ? 1 : 0;
  }

  std::vector<std::vector<int>> FindParts() const {
    SignedUnionFind sets(static_cast<int>(members_.size()));
    for (const SignedLink& link : links_) {
      if (WrongWay(link.a) != 0 && WrongWay(link.a) == WrongWay(link.b)) {
        sets.Join(link.a, link.b, 0);
      }
    }
    std::vector<std::vector<int>> parts(members_.size());
    for (int p = 0; p < static_cast<int>(members_.size()); ++p) {
      if (WrongWay(p) != 0) parts[sets.Find(p)].push_back(p);
    }
    std::erase_if(parts, [&](const std::vector<int>& part) {
      return part.empty() || Off(part, winding_) < kInsideOut;
    });
    return parts;
  }

  void Turn(const std::vector<int>& part) {
    for (const int p : part) {
      for (const int i : members_[p]) cloud_.normals.col(i) *= -1;
    }
  }

  // How far the mean over the points of a part is off the usual one.
  double Off(const std::vector<int>& part, const std::vector<double>& winding) const {
    double sum = 0, points = 0;
    for (const int p : part) {
      sum += winding[p] * static_cast<double>(members_[p].size());
      points += static_cast<double>(members_[p].size());
    }
    return std::abs(sum / points - usual_);
  }

  // Turns all, and back those that are no better for it. Whether any stays turned.
  absl::StatusOr<bool> TurnParts(const RunContext& context) {
    const std::vector<std::vector<int>> parts = FindParts();
    if (parts.empty()) return false;
    for (const std::vector<int>& part : parts) Turn(part);
    std::vector<double> turned;
    RILIEVO_RETURN_IF_ERROR(Look(context, &turned));
    bool any = false;
    for (const std::vector<int>& part : parts) {
      if (Off(part, turned) < kRight) {
        any = true;
      } else {
        Turn(part);
      }
    }
    if (any) RILIEVO_RETURN_IF_ERROR(Look(context, &winding_));
    return any;
  }

  const std::vector<SignedLink>& links_;
  OrientedCloud& cloud_;
  std::vector<std::vector<int>> members_;  // of each patch
  std::vector<double> winding_;            // on each patch
  double usual_ = 0;                       // of most of the scan, before anything was turned
};

}  // namespace

absl::Status FlipInvertedComponents(const OrientationPatches& patches,
                                    const std::vector<SignedLink>& links, OrientedCloud* cloud,
                                    const RunContext& context) {
  if (IsLeftOut(Mechanism::kInvertedComponents)) return absl::OkStatus();
  return PartSearch(patches, links, cloud).Run(context);
}

}  // namespace rilievo
