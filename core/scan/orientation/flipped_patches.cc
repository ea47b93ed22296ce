#include "core/scan/orientation/flipped_patches.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/orientation/dipole.h"
#include "core/scan/orientation/dipole_patch.h"
#include "core/scan/orientation/kernighan_lin.h"
#include "core/scan/orientation/settings.h"
#include "core/scan/orientation/winding_number.h"

namespace rilievo {
namespace {

// The way that the scan faces as one: zero unless the mean of its normals is longer than a
// hemisphere's.
Eigen::Vector3d FrontOf(const OrientedCloud& cloud) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0;
  for (Eigen::Index i = 0; i < cloud.normals.cols(); ++i) {
    const double share = ShareOfSurface(cloud.spacing[i]);
    sum += share * cloud.normals.col(i);
    area += share;
  }
  if (sum.norm() > kFlippedPatches.least_mean * area) return sum;
  return Eigen::Vector3d::Zero();
}

class FaceSearch {
 public:
  FaceSearch(const OrientationPatches& patches, const std::vector<SignedLink>& agreements,
             OrientedCloud* cloud)
      : cloud_(*cloud),
        front_(FrontOf(*cloud)),
        members_(static_cast<size_t>(patches.count)),
        links_(members_.size()),
        sign_(members_.size(), 1) {
    for (size_t i = 0; i < patches.patch.size(); ++i) {
      members_[patches.patch[i]].push_back(static_cast<int>(i));
    }
    for (const SignedLink& link : agreements) {
      links_[link.a].push_back({link.b, link.weight});
      links_[link.b].push_back({link.a, link.weight});
    }
  }

  absl::Status Run(const RunContext& context) {
    std::vector<int> next(members_.size());
    std::iota(next.begin(), next.end(), 0);
    for (int round = 0; round < kFlippedPatches.most_rounds; ++round) {
      std::erase_if(next,
                    [&](int p) { return VotesForTurning({p}) <= kFlippedPatches.least_votes; });
      if (next.empty()) break;
      RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> turned, Round(std::move(next), context));
      next = WithNeighbors(turned);
    }
    return absl::OkStatus();
  }

 private:
  struct Link {
    int to;
    double weight;  // > 0 where the normals that were given agree
  };

  bool IsFew(int patch) const { return members_[patch].size() < kCommon.fewest_of_plane; }

  double PresentWeight(int patch, const Link& link) const {
    return sign_[patch] * sign_[link.to] * link.weight;
  }

  void Turn(int patch) {
    sign_[patch] = -sign_[patch];
    for (const int i : members_[patch]) cloud_.normals.col(i) *= -1;
  }

  DipolePatch MakeFace(std::vector<int> patches) const {
    std::vector<int> points;
    for (const int patch : patches) {
      points.insert(points.end(), members_[patch].begin(), members_[patch].end());
    }
    return MakeDipolePatch(cloud_, points, std::move(patches));
  }

  // The patches and all that are linked to them, ascending.
  std::vector<int> WithNeighbors(const std::vector<int>& patches) const {
    std::vector<int> all = patches;
    for (const int p : patches) {
      for (const Link& link : links_[p]) all.push_back(link.to);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  // Whether the rest of the scan would have the patch the other way round.
  bool Disagrees(int patch, const WindingField& field) const {
    if (IsFew(patch)) return false;
    const DipolePatch face = MakeFace({patch});
    Eigen::Vector3d descent = field.DescentAt(face.sum.position);
    for (const Dipole& dipole : face.points) descent -= WindingDescent(dipole, face.sum.position);
    return descent.dot(face.sum.area) < 0;
  }

  // The patches that disagree among `next` and as far as they are linked to such, and all linked
  // to these: 1.
  absl::StatusOr<std::vector<uint8_t>> FindSuspects(std::vector<int> next,
                                                    const WindingField& field,
                                                    const RunContext& context) const {
    std::vector<uint8_t> suspects(members_.size(), 0), asked(members_.size(), 0);
    for (const int p : next) asked[p] = 1;
    while (!next.empty()) {
      std::vector<uint8_t> disagrees(next.size());
      const auto count = static_cast<int64_t>(next.size());
      RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kHeavyBlock, context, [&](int64_t i) {
        disagrees[i] = Disagrees(next[i], field);
      }));
      std::vector<int> further;
      for (size_t i = 0; i < next.size(); ++i) {
        if (disagrees[i] == 0) continue;
        suspects[next[i]] = 1;
        for (const Link& link : links_[next[i]]) {
          suspects[link.to] = 1;
          if (asked[link.to] == 0) further.push_back(link.to);
          asked[link.to] = 1;
        }
      }
      next = std::move(further);
    }
    return suspects;
  }

  // Suspects as far as they hang together.
  std::vector<std::vector<int>> Windows(std::vector<uint8_t> suspects) const {
    std::vector<std::vector<int>> windows;
    for (int p = 0; p < static_cast<int>(members_.size()); ++p) {
      if (suspects[p] == 0) continue;
      suspects[p] = 0;
      std::vector<int> window = {p};
      for (size_t i = 0; i < window.size(); ++i) {
        for (const Link& link : links_[window[i]]) {
          if (suspects[link.to] == 0) continue;
          suspects[link.to] = 0;
          window.push_back(link.to);
        }
      }
      std::sort(window.begin(), window.end());
      windows.push_back(std::move(window));
    }
    return windows;
  }

  // One for each patch of more than a few points, with the smaller ones that agree with it most.
  std::vector<DipolePatch> FacesOf(const std::vector<int>& window) const {
    std::vector<std::vector<int>> patches;
    std::vector<int> large;
    for (const int p : window) {
      if (IsFew(p)) continue;
      large.push_back(p);
      patches.push_back({p});
    }
    for (const int p : window) {
      if (!IsFew(p)) continue;
      double most = 0;
      int best = -1;
      for (const Link& link : links_[p]) {
        const double weight = PresentWeight(p, link);
        if (weight <= most) continue;
        const auto place = std::lower_bound(large.begin(), large.end(), link.to);
        if (place == large.end() || *place != link.to) continue;
        most = weight;
        best = static_cast<int>(place - large.begin());
      }
      if (best >= 0) patches[best].push_back(p);
    }
    std::vector<DipolePatch> faces;
    for (std::vector<int>& list : patches) faces.push_back(MakeFace(std::move(list)));
    return faces;
  }

  // How much the faces agree with each other and, in the last row and column, with the rest.
  // The share of the rest is what the field tells less what the faces do, whose blurs differ a
  // little. Unfinished after a stop request.
  Eigen::MatrixXd AgreementsOf(const std::vector<DipolePatch>& faces, const WindingField& field,
                               const RunContext& context) const {
    const auto count = static_cast<int64_t>(faces.size());
    Eigen::MatrixXd agreements = Eigen::MatrixXd::Zero(count + 1, count + 1);
    for (int64_t a = 0; a < count && context.CheckStop().ok(); ++a) {
      for (int64_t b = 0; b < a; ++b) {
        agreements(a, b) = agreements(b, a) = Agreement(faces[a], faces[b]);
      }
    }
    for (int64_t a = 0; a < count && context.CheckStop().ok(); ++a) {
      double rest = -Agreement(faces[a], faces[a]) - agreements.col(a).sum();
      for (const Dipole& point : faces[a].points) {
        rest += point.area.dot(field.DescentAt(point.position));
      }
      agreements(a, count) = agreements(count, a) = rest;
    }
    return agreements;
  }

  // Patches of the window to turn; none after a stop request.
  std::vector<int> Search(const std::vector<int>& window, const WindingField& field,
                          const RunContext& context) const {
    const std::vector<DipolePatch> faces = FacesOf(window);
    if (faces.size() > kFlippedPatches.most_faces) return {};
    const Eigen::MatrixXd agreements = AgreementsOf(faces, field, context);
    Eigen::VectorXd signs = Eigen::VectorXd::Ones(agreements.rows());
    // Ends: each pass gains at least this share of all there is to gain.
    const double least_gain = kCommon.rounding * agreements.cwiseAbs().sum();
    while (KernighanLinPass(agreements, &signs) > least_gain) {
      if (!context.CheckStop().ok()) return {};
    }
    signs *= signs[signs.size() - 1];  // the rest stays
    return SureGains(faces, agreements, signs);
  }

  // Faces to turn that touch each other, as one.
  static std::vector<std::vector<int>> Together(const std::vector<DipolePatch>& faces,
                                                const Eigen::VectorXd& signs) {
    std::vector<std::vector<int>> sets;
    std::vector<uint8_t> left(faces.size());
    for (size_t f = 0; f < faces.size(); ++f) left[f] = signs[static_cast<int64_t>(f)] < 0;
    for (int first = 0; first < static_cast<int>(faces.size()); ++first) {
      if (left[first] == 0) continue;
      left[first] = 0;
      std::vector<int> set = {first};
      for (size_t i = 0; i < set.size(); ++i) {
        for (int f = 0; f < static_cast<int>(faces.size()); ++f) {
          if (left[f] == 0 || !Touch(faces[set[i]], faces[f])) continue;
          left[f] = 0;
          set.push_back(f);
        }
      }
      sets.push_back(std::move(set));
    }
    return sets;
  }

  // The share of the votes between these patches and all others that would have them turned.
  double VotesForTurning(std::vector<int> patches) const {
    std::sort(patches.begin(), patches.end());
    double turn = 0, total = 0;
    for (const int p : patches) {
      for (const Link& link : links_[p]) {
        if (std::binary_search(patches.begin(), patches.end(), link.to)) continue;
        turn += std::max(0.0, -PresentWeight(p, link));
        total += std::abs(link.weight);
      }
    }
    return total > 0 ? turn / total : 1;
  }

  // Share of the points that lie in patches of few.
  double ShareInFew(const std::vector<int>& patches) const {
    size_t few = 0, all = 0;
    for (const int p : patches) {
      all += members_[p].size();
      if (IsFew(p)) few += members_[p].size();
    }
    return static_cast<double>(few) / static_cast<double>(all);
  }

  // Patches of those faces to turn that surely gain.
  std::vector<int> SureGains(const std::vector<DipolePatch>& faces,
                             const Eigen::MatrixXd& agreements,
                             const Eigen::VectorXd& signs) const {
    std::vector<int> turned;
    for (const std::vector<int>& set : Together(faces, signs)) {
      std::vector<int> patches;
      Eigen::VectorXd others = signs;
      double size = 0, gain = 0;
      Eigen::Vector3d area = Eigen::Vector3d::Zero();
      for (const int f : set) {
        patches.insert(patches.end(), faces[f].patches.begin(), faces[f].patches.end());
        others[f] = 0;
        size += faces[f].size;
        area += faces[f].sum.area;
      }
      for (const int f : set) gain -= agreements.col(f).dot(others);
      if (gain * std::sqrt(size / std::numbers::pi) < kFlippedPatches.least_gain * size) continue;
      if (front_.dot(area) > 0) continue;
      if (VotesForTurning(patches) < kFlippedPatches.least_votes ||
          ShareInFew(patches) > kFlippedPatches.most_in_few)
        continue;
      turned.insert(turned.end(), patches.begin(), patches.end());
    }
    return turned;
  }

  // Turns the small patches of a window that go against their votes now.
  void TurnFew(const std::vector<int>& window, std::vector<int>* turned) {
    for (const int p : window) {
      if (!IsFew(p)) continue;
      double votes = 0;
      for (const Link& link : links_[p]) votes += PresentWeight(p, link);
      if (votes >= 0) continue;
      Turn(p);
      turned->push_back(p);
    }
  }

  // Searches around those of `doubtful` that disagree with the rest; returns what was turned.
  absl::StatusOr<std::vector<int>> Round(std::vector<int> doubtful, const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> all(cloud_.spacing.size());
    std::iota(all.begin(), all.end(), 0);
    const WindingField field(cloud_, std::move(all));
    RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> suspects,
                             FindSuspects(std::move(doubtful), field, context));
    const std::vector<std::vector<int>> windows = Windows(std::move(suspects));
    std::vector<std::vector<int>> to_turn(windows.size());
    RILIEVO_RETURN_IF_ERROR(
        ParallelForEach(static_cast<int64_t>(windows.size()), 1, context,
                        [&](int64_t w) { to_turn[w] = Search(windows[w], field, context); }));
    std::vector<int> turned;
    for (const std::vector<int>& list : to_turn) {
      for (const int patch : list) Turn(patch);
      turned.insert(turned.end(), list.begin(), list.end());
    }
    for (size_t w = 0; w < windows.size(); ++w) {
      if (!to_turn[w].empty()) TurnFew(windows[w], &turned);
    }
    return turned;
  }

  OrientedCloud& cloud_;
  const Eigen::Vector3d front_;
  std::vector<std::vector<int>> members_;  // of each patch
  std::vector<std::vector<Link>> links_;   // of each patch
  std::vector<int> sign_;                  // of each patch: -1 when turned
};

}  // namespace

absl::Status FlipInvertedPatches(const OrientationPatches& patches,
                                 const std::vector<SignedLink>& agreements, OrientedCloud* cloud,
                                 const RunContext& context) {
  if (IsLeftOut(Mechanism::kInvertedPatches)) return absl::OkStatus();
  return FaceSearch(patches, agreements, cloud).Run(context);
}

}  // namespace rilievo
