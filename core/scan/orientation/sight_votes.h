// What a scanner knows of the sides of a surface: where points were seen from, and given normals.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point_sights.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

enum class SightRule {
  kAuto,    // used when it is there and believable
  kUse,     // used without a check
  kIgnore,  // not used
};

struct SightOptions {
  SightRule stations = SightRule::kAuto;
  SightRule normals = SightRule::kAuto;
};

// Of stations or of given normals. Shares are of what was given.
struct SightFigures {
  int64_t points = 0;      // that have one
  double usable = 0;       // share of given normals whose length is 1; 1 for stations
  double alignment = 0;    // median |cosine| between a given normal and the one of the points
  double consistency = 0;  // share of the votes that is left once those for either side cancel out
  bool used = false;
};

// By point, in [-1, 1]: above 0 where the normal as it is points to the side that was seen, below 0
// where to the other one; 0 where nothing is known or the point was seen along its surface.
using SideVotes = std::vector<float>;

// What a given normal weighs against a station: it may be wrong, and half as much is outvoted by
// the neighbours of a single point.
inline constexpr float kNormalWeight = 0.5F;

// The cosine between the normal and the way to the station. No votes without stations.
SideVotes StationVotes(const PointSights& sights, const OrientedCloud& cloud,
                       SightFigures* figures);

// The cosine between the normal and the given one. Normals that are not of length 1 have no vote.
SideVotes NormalVotes(const PointSights& sights, const OrientedCloud& cloud, SightFigures* figures);

// By point, up to a factor: the solid angle that its share of the surface, were it seen from the
// front, has at its station. 0 without a station; no weights without stations.
std::vector<float> StationWeights(const PointSights& sights, const OrientedCloud& cloud);

// The share of the votes that is left once those for either side of a component cancel out: 1 where
// all members of each component agree, near 0 where the votes are chance. With the weights of
// stations it is 0 for a closed surface that has its station outside, near or far: whatever way its
// far side is seen through the near one, both have the same solid angle. `signs`: by point, that of
// its normal within its component; `weights`: by point, or empty for 1 each.
double ConsistencyOf(const SideVotes& votes, const std::vector<float>& weights,
                     const std::vector<int>& component, const std::vector<int8_t>& signs);

// Whether as many are usable, and lie as well along the points, as is believed.
bool UsableEnough(const SightFigures& figures);
bool AlignedEnough(const SightFigures& figures);

// Whether what was found may be used as the rule says.
bool IsBelieved(SightRule rule, const SightFigures& figures);

}  // namespace rilievo
