#include "core/scan/orientation/sight_votes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/quantile.h"
#include "core/scan/orientation/settings.h"

namespace rilievo {

SideVotes StationVotes(const PointSights& sights, const OrientedCloud& cloud,
                       SightFigures* figures) {
  SideVotes votes;
  if (sights.stations.cols() == 0) return votes;
  figures->usable = figures->alignment = 1;
  votes.assign(sights.station_of.size(), 0);
  for (size_t i = 0; i < votes.size(); ++i) {
    if (sights.station_of[i] == kNoStation) continue;
    ++figures->points;
    const auto point = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d way = sights.stations.col(sights.station_of[i]) - cloud.points.col(point);
    votes[i] = static_cast<float>(cloud.normals.col(point).dot(way.stableNormalized()));
  }
  return votes;
}

SideVotes NormalVotes(const PointSights& sights, const OrientedCloud& cloud,
                      SightFigures* figures) {
  SideVotes votes(static_cast<size_t>(sights.normals.cols()), 0);
  std::vector<float> cosines;
  for (Eigen::Index i = 0; i < sights.normals.cols(); ++i) {
    const Eigen::Vector3d given = sights.normals.col(i).cast<double>();
    const double length = given.stableNorm();
    if (length == 0 || !std::isfinite(length)) continue;
    ++figures->points;
    if (std::abs(length - 1) > kSightVotes.length_tolerance) continue;
    votes[i] = static_cast<float>(cloud.normals.col(i).dot(given / length));
    cosines.push_back(std::abs(votes[i]));
  }
  if (cosines.empty()) return votes;
  figures->usable = static_cast<double>(cosines.size()) / static_cast<double>(figures->points);
  figures->alignment = Median(std::move(cosines));
  return votes;
}

std::vector<float> StationWeights(const PointSights& sights, const OrientedCloud& cloud) {
  std::vector<float> weights(sights.stations.cols() == 0 ? 0 : sights.station_of.size(), 0.0F);
  for (size_t i = 0; i < weights.size(); ++i) {
    if (sights.station_of[i] == kNoStation) continue;
    const auto way =
        sights.stations.col(sights.station_of[i]) - cloud.points.col(static_cast<Eigen::Index>(i));
    const double side = cloud.spacing[i];
    // No point spans more than the space in front of it.
    weights[i] = static_cast<float>(side * side / std::max(way.squaredNorm(), side * side));
  }
  return weights;
}

double ConsistencyOf(const SideVotes& votes, const std::vector<float>& weights,
                     const std::vector<int>& component, const std::vector<int8_t>& signs) {
  std::vector<double> sums;
  double total = 0;
  for (size_t i = 0; i < votes.size(); ++i) {
    const auto place = static_cast<size_t>(component[i]);
    if (place >= sums.size()) sums.resize(place + 1, 0.0);
    const double vote = double{votes[i]} * (weights.empty() ? 1.0 : double{weights[i]});
    sums[place] += signs[i] * vote;
    total += std::abs(vote);
  }
  double left = 0;
  for (const double sum : sums) left += std::abs(sum);
  return total > 0 ? left / total : 0;
}

bool UsableEnough(const SightFigures& figures) { return figures.usable >= kSightVotes.least_share; }

bool AlignedEnough(const SightFigures& figures) {
  return figures.alignment >= kSightVotes.least_alignment;
}

bool IsBelieved(SightRule rule, const SightFigures& figures) {
  if (rule != SightRule::kAuto) return rule == SightRule::kUse && figures.points > 0;
  return UsableEnough(figures) && AlignedEnough(figures) &&
         figures.consistency >= kSightVotes.least_share;
}

}  // namespace rilievo
