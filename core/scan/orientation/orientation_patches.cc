#include "core/scan/orientation/orientation_patches.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/scratch_pool.h"
#include "core/base/serial_for.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/orientation/settings.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// A patch as a disc; the normal is that of its first point's side.
struct Disc {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double radius = 0;     // RMS distance of its points from the centre
  double thickness = 0;  // RMS distance of its points from its plane
  double spacing = 0;    // mean of its points'
  int points = 0;
};

std::vector<Disc> DiscsOf(const OrientationPatches& patches, const OrientedCloud& cloud) {
  std::vector<Disc> discs(static_cast<size_t>(patches.count));
  std::vector<Eigen::Vector3d> first(discs.size());
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    const auto point = static_cast<int64_t>(i);
    Disc& disc = discs[patches.patch[i]];
    if (disc.points++ == 0) first[patches.patch[i]] = cloud.points.col(point);
    const Eigen::Vector3d offset = cloud.points.col(point) - first[patches.patch[i]];
    disc.center += offset;
    disc.radius += offset.squaredNorm();
    disc.normal += (patches.parity[i] != 0 ? -1 : 1) * cloud.normals.col(point);
    disc.spacing += cloud.spacing[i];
  }
  for (size_t p = 0; p < discs.size(); ++p) {
    Disc& disc = discs[p];
    disc.center /= disc.points;
    disc.radius = std::sqrt(std::max(0.0, disc.radius / disc.points - disc.center.squaredNorm()));
    disc.center += first[p];
    disc.spacing /= disc.points;
    disc.normal.normalize();
  }
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    Disc& disc = discs[patches.patch[i]];
    const double height = disc.normal.dot(cloud.points.col(static_cast<int64_t>(i)) - disc.center);
    disc.thickness += height * height / disc.points;
  }
  for (Disc& disc : discs) disc.thickness = std::sqrt(disc.thickness);
  return discs;
}

// What the edges from one patch to another say.
struct Votes {
  double sum = 0;
  int count = 0;
  Eigen::Vector3d along = Eigen::Vector3d::Zero();  // sum of the edges along the plane
  double length = 0;                                // and of their lengths along it
};

// Whether one disc lies over the other: their planes are parallel, apart by more than noise and
// spacing explain, their centres closer along the planes than their radii together, and the edges
// between them lead all around, and not to one side, as they do to a window set back in its wall.
bool FaceEachOther(const Disc& a, const Disc& b, const Votes& votes) {
  if (std::min(a.points, b.points) < kCommon.fewest_of_plane) return false;
  const double cosine = a.normal.dot(b.normal);
  if (std::abs(cosine) < kCommon.smooth_cosine) return false;
  const Eigen::Vector3d chord = b.center - a.center;
  const double height_a = chord.dot(a.normal);
  const double height_b = std::copysign(1.0, cosine) * chord.dot(b.normal);
  // Zero on an arc, and between planes their distance.
  const double step = std::abs(height_a + height_b) / 2;
  const double spacing = std::min(a.spacing, b.spacing);
  if (step < std::max(kOrientationPatches.thicknesses * (a.thickness + b.thickness),
                      kEdgeSignVotes.sheet_spacings * spacing)) {
    return false;
  }
  const double along = std::sqrt(std::max(0.0, chord.squaredNorm() - step * step));
  return along < kOrientationPatches.overlap * (a.radius + b.radius) &&
         votes.along.norm() < (1 - kEdgeSignVotes.all_around) * votes.length;
}

// Calls join(a, b, opposite) for the edges below level `end`, by level and each level in their
// order. They are listed by some levels at a time, so that lists hold two edges a point at most; a
// level with more needs none.
template <typename Join>
absl::Status ForEachSureEdge(const NeighborGraph& graph, const std::vector<float>& relations,
                             const std::vector<uint16_t>& levels, int end,
                             const RunContext& context, const Join& join) {
  struct Edge {
    int a, b;  // ~b: opposite
  };
  const int64_t most = 2 * int64_t{graph.size()};
  std::vector<int64_t> count(static_cast<size_t>(end) + 1, 0);
  for (const uint16_t level : levels) ++count[level];
  std::vector<Edge> list;
  std::vector<int64_t> next;
  for (int first = 0, last = 0; first < end; first = last) {
    int64_t total = count[last++];
    while (last < end && total + count[last] <= most) total += count[last++];
    if (total > most) {
      RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t a) {
        for (int64_t edge = a * graph.k; edge < (a + 1) * graph.k; ++edge) {
          if (levels[edge] != first) continue;
          join(static_cast<int>(a), graph.indices[edge], relations[edge] < 0 ? 1 : 0);
        }
      }));
      continue;
    }
    next.assign(1, 0);
    for (int level = first; level < last; ++level) next.push_back(next.back() + count[level]);
    if (list.capacity() < static_cast<size_t>(total)) list = std::vector<Edge>();
    list.resize(static_cast<size_t>(total));
    const auto width = static_cast<unsigned>(last - first);
    RILIEVO_RETURN_IF_ERROR(SerialFor(graph.size(), context, [&](int64_t a) {
      for (int64_t edge = a * graph.k; edge < (a + 1) * graph.k; ++edge) {
        if (static_cast<unsigned>(levels[edge] - first) >= width) continue;
        const int b = graph.indices[edge];
        list[next[levels[edge] - first]++] = {static_cast<int>(a), relations[edge] < 0 ? ~b : b};
      }
    }));
    RILIEVO_RETURN_IF_ERROR(SerialFor(total, context, [&](int64_t i) {
      const auto [a, b] = list[i];
      join(a, b < 0 ? ~b : b, b < 0 ? 1 : 0);
    }));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<OrientationPatches> SurePatches(const NeighborGraph& graph,
                                               const std::vector<float>& relations,
                                               const RunContext& context) {
  const int k = graph.k;
  // How sure each edge is, in levels, or kOrientationPatches.levels: not sure, or said from its
  // other end already.
  std::vector<uint16_t> levels(relations.size());
  const auto level_of = [&](int a, size_t edge) {
    const double doubt = (1 - std::abs(relations[edge])) / (1 - kOrientationPatches.sure);
    if (doubt >= 1) return kOrientationPatches.levels;
    const int b = graph.indices[edge];
    if (b < a) {
      const auto others = graph.neighbors(b);
      const auto place = std::find(others.begin(), others.end(), a) - others.begin();
      if (place < k && relations[static_cast<size_t>(b) * k + place] == relations[edge]) {
        return kOrientationPatches.levels;
      }
    }
    return static_cast<int>(std::max(doubt, 0.0) * kOrientationPatches.levels);
  };
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(graph.size(), kLightBlock, context, [&](int64_t a) {
    for (size_t edge = a * k; edge < static_cast<size_t>(a + 1) * k; ++edge) {
      levels[edge] = static_cast<uint16_t>(level_of(static_cast<int>(a), edge));
    }
  }));
  SignedUnionFind sets(graph.size());
  RILIEVO_RETURN_IF_ERROR(ForEachSureEdge(graph, relations, levels, kOrientationPatches.levels,
                                          context, [&](int a, int b, uint8_t opposite) {
                                            const int root_a = sets.Find(a), root_b = sets.Find(b);
                                            if (root_a == root_b ||
                                                sets.size(root_a) + sets.size(root_b) >
                                                    kOrientationPatches.largest_patch)
                                              return;
                                            sets.Join(a, b, opposite);
                                          }));
  levels = std::vector<uint16_t>();
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

absl::StatusOr<std::vector<SignedLink>> LinksBetween(const OrientationPatches& patches,
                                                     const NeighborGraph& graph,
                                                     const std::vector<float>& relations,
                                                     const OrientedCloud& cloud,
                                                     const RunContext& context) {
  const std::vector<Disc> discs = DiscsOf(patches, cloud);
  // Points by patch.
  std::vector<int> begin_of(discs.size() + 1, 0), members(patches.patch.size());
  for (const int patch : patches.patch) ++begin_of[patch + 1];
  std::partial_sum(begin_of.begin(), begin_of.end(), begin_of.begin());
  for (int i = 0; i < graph.size(); ++i) members[begin_of[patches.patch[i]]++] = i;
  const std::vector<Votes> no_votes(discs.size());
  ScratchPool<std::vector<Votes>> pool(no_votes);
  const auto link = [&](int64_t begin, int64_t end) {
    std::vector<SignedLink> links;
    const auto loan = pool.Take();
    std::vector<Votes>& votes = *loan;  // of the neighbours of one patch
    std::vector<int> neighbors;
    const auto vote = [&](int i, int other, double relation) {
      const int to = patches.patch[other];
      if (to == patches.patch[i]) return;
      if (votes[to].count++ == 0) neighbors.push_back(to);
      votes[to].sum += patches.parity[i] == patches.parity[other] ? relation : -relation;
      const Eigen::Vector3d& normal = discs[patches.patch[i]].normal;
      Eigen::Vector3d along = cloud.points.col(other) - cloud.points.col(i);
      along -= along.dot(normal) * normal;
      votes[to].along += along;
      votes[to].length += along.norm();
    };
    for (int patch = static_cast<int>(begin); patch < end; ++patch) {
      // Filling the list has moved each begin to the next patch's.
      for (int m = patch == 0 ? 0 : begin_of[patch - 1]; m < begin_of[patch]; ++m) {
        const int i = members[m];
        for (int k = 0; k < graph.k; ++k) {
          const size_t edge = static_cast<size_t>(i) * graph.k + k;
          vote(i, graph.indices[edge], relations[edge]);
        }
        const int across = graph.across(i);
        if (across < 0) continue;
        vote(i, across,
             -kOrientationPatches.facing_votes *
                 cloud.normals.col(i).dot(cloud.normals.col(across)));
      }
      for (const int to : neighbors) {
        if (FaceEachOther(discs[patch], discs[to], votes[to])) {
          votes[to].sum = -kEdgeSignVotes.wall_worth * votes[to].count *
                          discs[patch].normal.dot(discs[to].normal);
        }
        links.push_back({patch, to, votes[to].sum});
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
