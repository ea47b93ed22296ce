#include "core/scan/orientation/orientation_patches.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>

#include "core/base/parallel_for.h"
#include "core/base/scratch_pool.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/dipole.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// A patch as one dipole, of the side of its first point.
struct PatchDipole {
  Dipole dipole;
  double size = 0;  // area, however it is turned
  int points = 0;
  double Spacing() const { return std::sqrt(4 * std::numbers::inv_pi * size / points); }
};

// A dipole spread over the radius of a flat disc has the disc's field along its axis; the squared
// radius is twice the mean square of the points' distances.
std::vector<PatchDipole> DipolesOf(const OrientationPatches& patches, const OrientedCloud& cloud) {
  std::vector<PatchDipole> all(static_cast<size_t>(patches.count));
  std::vector<Eigen::Vector3d> first(all.size());
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    const auto point = static_cast<int64_t>(i);
    PatchDipole& patch = all[patches.patch[i]];
    if (patch.points++ == 0) first[patches.patch[i]] = cloud.points.col(point);
    const Eigen::Vector3d offset = cloud.points.col(point) - first[patches.patch[i]];
    const Dipole own = DipoleOf(cloud, static_cast<int>(i));
    const double share = ShareOfSurface(cloud.spacing[i]);
    patch.size += share;
    patch.dipole.position += share * offset;
    patch.dipole.blur += share * 2 * (offset.squaredNorm() + own.blur);
    patch.dipole.area += patches.parity[i] != 0 ? -own.area : own.area;
  }
  for (size_t p = 0; p < all.size(); ++p) {
    Dipole& dipole = all[p].dipole;
    dipole.position /= all[p].size;
    dipole.blur = dipole.blur / all[p].size - 2 * dipole.position.squaredNorm();
    dipole.position += first[p];
  }
  return all;
}

// What two patches say of each other as dipoles, in spacings. Only where one lies over the other:
// at any distance, as of a roof from the ground, what is around them counts as much.
double DipoleVote(const PatchDipole& a, const PatchDipole& b) {
  constexpr double kOver = 0.7;  // of their squared radii together
  const double distance = (b.dipole.position - a.dipole.position).squaredNorm();
  if (distance > kOver * (a.dipole.blur + b.dipole.blur)) return 0;
  return 2 * Agreement(a.dipole, b.dipole) / (a.Spacing() + b.Spacing());
}

}  // namespace

absl::StatusOr<OrientationPatches> SurePatches(const NeighborGraph& graph,
                                               const std::vector<float>& relations,
                                               const RunContext& context) {
  constexpr int kLargestPatch = 48;
  constexpr double kSure = 0.7;
  constexpr int kBands = 32;
  // How unsure each edge is, in bands; kBands: not sure.
  std::vector<uint8_t> bands(relations.size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(bands.size()), kLightBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t edge = begin; edge < end; ++edge) {
          const double doubt = (1 - std::abs(relations[edge])) / (1 - kSure);
          bands[edge] = static_cast<uint8_t>(std::clamp(doubt, 0.0, 1.0) * kBands);
        }
      }));
  SignedUnionFind sets(graph.size());
  for (int band = 0; band < kBands; ++band) {
    RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t a) {
      for (int64_t edge = a * graph.k; edge < (a + 1) * graph.k; ++edge) {
        if (bands[edge] != band) continue;
        const int b = graph.indices[edge];
        const int root_a = sets.Find(static_cast<int>(a)), root_b = sets.Find(b);
        if (root_a == root_b || sets.size(root_a) + sets.size(root_b) > kLargestPatch) continue;
        sets.Join(static_cast<int>(a), b, relations[edge] < 0 ? 1 : 0);
      }
    }));
  }
  bands = std::vector<uint8_t>();
  OrientationPatches result;
  result.patch.resize(static_cast<size_t>(graph.size()));
  result.parity.resize(result.patch.size());
  std::vector<int> number(result.patch.size(), -1);
  for (int i = 0; i < graph.size(); ++i) {
    const int root = sets.Find(i);
    if (number[root] < 0) number[root] = result.count++;
    result.patch[i] = number[root];
    result.parity[i] = sets.parity(i);
  }
  return result;
}

absl::StatusOr<std::vector<SignedLink>> LinksBetween(
    const OrientationPatches& patches, const NeighborGraph& graph, const ReplacedLists& replaced,
    const std::vector<float>& relations, const OrientedCloud& cloud, const RunContext& context) {
  const std::vector<PatchDipole> dipoles = DipolesOf(patches, cloud);
  // Points by patch.
  std::vector<int> begin_of(dipoles.size() + 1, 0), members(patches.patch.size());
  for (const int patch : patches.patch) ++begin_of[patch + 1];
  std::partial_sum(begin_of.begin(), begin_of.end(), begin_of.begin());
  for (int i = 0; i < graph.size(); ++i) members[begin_of[patches.patch[i]]++] = i;
  // By point, its place among the replaced lists plus 1.
  std::vector<int> place(replaced.points.empty() ? 0 : members.size(), 0);
  for (size_t i = 0; i < replaced.points.size(); ++i) {
    place[replaced.points[i]] = static_cast<int>(i) + 1;
  }
  struct Votes {
    double sum = 0;
    int count = 0;
  };
  const std::vector<Votes> no_votes(dipoles.size());
  ScratchPool<std::vector<Votes>> pool(no_votes);
  const auto link = [&](int64_t begin, int64_t end) {
    std::vector<SignedLink> links;
    const auto loan = pool.Take();
    std::vector<Votes>& votes = *loan;  // of the neighbours of one patch
    std::vector<int> neighbors;
    const auto vote = [&](int patch, int to, double weight) {
      if (to == patch) return;
      if (votes[to].count++ == 0) neighbors.push_back(to);
      votes[to].sum += weight;
    };
    for (int patch = static_cast<int>(begin); patch < end; ++patch) {
      // Filling the list has moved each begin to the next patch's.
      for (int m = patch == 0 ? 0 : begin_of[patch - 1]; m < begin_of[patch]; ++m) {
        const int i = members[m];
        for (int k = 0; k < graph.k; ++k) {
          const size_t edge = static_cast<size_t>(i) * graph.k + k;
          const int j = graph.indices[edge];
          const double relation = relations[edge];
          vote(patch, patches.patch[j],
               patches.parity[i] == patches.parity[j] ? relation : -relation);
        }
        if (place.empty() || place[i] == 0) continue;
        for (const int j : replaced.list(place[i] - 1, graph.k)) vote(patch, patches.patch[j], 0);
      }
      for (const int to : neighbors) {
        const double facing = graph.k * DipoleVote(dipoles[patch], dipoles[to]);
        links.push_back({patch, to, votes[to].sum + facing});
        votes[to] = {};
      }
      neighbors.clear();
    }
    return links;
  };
  std::vector<std::vector<SignedLink>> parts(
      static_cast<size_t>((patches.count + kHeavyBlock - 1) / kHeavyBlock));
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      patches.count, kHeavyBlock, context,
      [&](int64_t begin, int64_t end) { parts[begin / kHeavyBlock] = link(begin, end); }));
  size_t count = 0;
  for (const auto& part : parts) count += part.size();
  std::vector<SignedLink> links;
  links.reserve(count);
  for (auto& part : parts) {
    links.insert(links.end(), part.begin(), part.end());
    part = std::vector<SignedLink>();
  }
  return links;
}

}  // namespace rilievo
