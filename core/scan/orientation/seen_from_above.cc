#include "core/scan/orientation/seen_from_above.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "core/base/parallel_for.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/scan/orientation/outward_sign.h"
#include "core/scan/orientation/sight_votes.h"
#include "core/scan/orientation/signed_union_find.h"

namespace rilievo {
namespace {

// By point: 1 where another one lies above or below it, within the same cell of a grid across z,
// and off its own plane.
absl::StatusOr<std::vector<uint8_t>> FindLayered(const OrientedCloud& cloud,
                                                 const RunContext& context) {
  constexpr double kCellSpacings = 1.4;  // about two points
  constexpr double kLeastCell = 1e-6;
  constexpr double kSpacingsOff = 0.5, kNoisesOff = 2;
  const double cell = std::max(kCellSpacings * cloud.median_spacing, kLeastCell);
  struct Place {
    int column, row, point;
    auto operator<=>(const Place&) const = default;
    bool IsBeside(const Place& other) const { return column == other.column && row == other.row; }
  };
  std::vector<Place> places;
  places.reserve(cloud.spacing.size());
  for (Eigen::Index i = 0; i < cloud.points.cols(); ++i) {
    places.push_back({static_cast<int>(std::floor(cloud.points(0, i) / cell)),
                      static_cast<int>(std::floor(cloud.points(1, i) / cell)),
                      static_cast<int>(i)});
  }
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &places));
  const auto height = [&](const Place& place) { return cloud.points(2, place.point); };
  const auto is_off = [&](int i, int other, double side) {
    const Eigen::Vector3d way = cloud.points.col(other) - cloud.points.col(i);
    const double margin =
        std::max<double>(kSpacingsOff * cloud.spacing[i], kNoisesOff * cloud.noise[i]);
    return side * way.z() > margin && std::abs(way.dot(cloud.normals.col(i))) > margin;
  };
  std::vector<uint8_t> layered(places.size(), 0);
  for (auto begin = places.begin(), end = begin; begin != places.end(); begin = end) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    auto top = begin, bottom = begin;
    for (; end != places.end() && end->IsBeside(*begin); ++end) {
      if (height(*end) > height(*top)) top = end;
      if (height(*end) < height(*bottom)) bottom = end;
    }
    for (auto place = begin; place != end; ++place) {
      const int i = place->point;
      layered[i] = is_off(i, top->point, 1) || is_off(i, bottom->point, -1);
    }
  }
  return layered;
}

// By patch: for the normals as they are where > 0, against them where < 0.
absl::StatusOr<std::vector<double>> SkyVotes(const OrientationPatches& patches,
                                             const OrientedCloud& cloud,
                                             const std::vector<uint8_t>& layered,
                                             const RunContext& context) {
  constexpr double kMostLayered = 0.1;
  // What stands steeper may lean either way.
  constexpr double kLeastCosine = 0.4;
  std::vector<double> votes(static_cast<size_t>(patches.count), 0.0);
  std::vector<int> size(votes.size(), 0), within(votes.size(), 0);
  for (size_t i = 0; i < layered.size(); ++i) {
    if (i % kLightBlock == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const int patch = patches.patch[i];
    const double cosine = cloud.normals(2, static_cast<Eigen::Index>(i));
    ++size[patch];
    within[patch] += layered[i];
    if (std::abs(cosine) > kLeastCosine) votes[patch] += cosine;
  }
  for (size_t patch = 0; patch < votes.size(); ++patch) {
    if (within[patch] > kMostLayered * size[patch]) votes[patch] = 0;
  }
  return votes;
}

// Of the patches with 1 those sets keep it that votes are against as they are, and that hang on
// others by links of which a good part, by weight, would have them turned.
void KeepContested(const std::vector<SignedLink>& agreements, const std::vector<double>& votes,
                   std::vector<uint8_t>* turned) {
  SignedUnionFind sets(static_cast<int>(turned->size()));
  for (const SignedLink& link : agreements) {
    if ((*turned)[link.a] != 0 && (*turned)[link.b] != 0) sets.Join(link.a, link.b, 0);
  }
  std::vector<double> wanted(turned->size(), 0.0), against(wanted), total(wanted);
  for (size_t patch = 0; patch < votes.size(); ++patch) {
    wanted[sets.Find(static_cast<int>(patch))] -= votes[patch];
  }
  for (const SignedLink& link : agreements) {
    if ((*turned)[link.a] == (*turned)[link.b]) continue;
    const int set = sets.Find((*turned)[link.a] != 0 ? link.a : link.b);
    against[set] += std::max(0.0, -link.weight);
    total[set] += std::abs(link.weight);
  }
  for (size_t patch = 0; patch < turned->size(); ++patch) {
    const int set = sets.Find(static_cast<int>(patch));
    const bool is_contested = total[set] > 0 && against[set] >= kLeastVotes * total[set];
    if (wanted[set] <= 0 || !is_contested) (*turned)[patch] = 0;
  }
}

}  // namespace

absl::Status TurnToSky(const OrientationPatches& patches, const std::vector<SignedLink>& agreements,
                       int k, OrientedCloud* cloud, const RunContext& context) {
  constexpr double kLeastUp = 0.75;
  if (MeanNormal(*cloud).z() < kLeastUp) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> layered, FindLayered(*cloud, context));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<double> votes, SkyVotes(patches, *cloud, layered, context));
  for (double& vote : votes) vote *= double{kNormalWeight} * k;
  RILIEVO_ASSIGN_OR_RETURN(const SignedLabels labels,
                           LabelSignedGraph(patches.count, agreements, votes, context));
  std::vector<uint8_t> turned(votes.size());
  for (size_t patch = 0; patch < turned.size(); ++patch) {
    turned[patch] = labels.component[patch] == labels.sided && labels.sign[patch] < 0;
  }
  KeepContested(agreements, votes, &turned);
  for (size_t i = 0; i < patches.patch.size(); ++i) {
    if (turned[patches.patch[i]] != 0) cloud->normals.col(static_cast<Eigen::Index>(i)) *= -1;
  }
  return absl::OkStatus();
}

}  // namespace rilievo
