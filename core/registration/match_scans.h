// Points of two scans that show the same place of a surface.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/registration/scan_sample.h"

namespace rilievo {

// One place, seen twice; unit frame, the scans where their poses put them.
struct ScanMatch {
  Eigen::Vector3d first, second;  // one point of each scan
  // Unit: the mean of both normals (S. Rusinkiewicz, "A symmetric objective function for ICP", ACM
  // TOG 38, 2019), under which points of one quadric have no distance.
  Eigen::Vector3d normal;
  double Distance() const { return normal.dot(first - second); }  // across the surface
};

struct ScanMatches {
  std::vector<ScanMatch> matches;
  // Of the points of each scan that were asked, the share that lies on the surface of the other.
  double share_of_first = 0, share_of_second = 0;
};

// Where the pose puts a point of the unit frame.
using Pose = Eigen::Isometry3d;

// Asks at most `most_points` points of each scan, evenly by their rank along the Morton curve, for
// the nearest point of the other one. The two match when their normals are within 60 degrees, their
// distance across the surface is at most `reach`, and the one lies within a spacing of the other
// along the surface: points beyond the border of the other scan match nothing (G. Turk and M.
// Levoy, "Zippered polygon meshes from range images", SIGGRAPH 1994), so scans that do not overlap
// do not pull at each other.
ScanMatches FindMatches(const ScanSample& first, const Pose& first_pose, const ScanSample& second,
                        const Pose& second_pose, double reach, int64_t most_points);

// 1.4826 times the median distance of the matches, the standard deviation of Gaussian ones; 0
// without matches.
double SpreadOf(const std::vector<ScanMatch>& matches);

}  // namespace rilievo
