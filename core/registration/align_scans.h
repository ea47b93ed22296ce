// Rigid registration of several overlapping scans that lie roughly where they belong.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"

namespace rilievo {

struct AlignmentOptions {
  // How far a scan may be off, against another one: fraction of the diagonal of all scans. (0,
  // 0.5]. Two scans that are turned by 5 degrees and moved by 3 %, either its own way, are 0.15
  // apart.
  double reach = 0.15;
  // Of the points of one of two scans, the share that must lie on the surface of the other: below,
  // borders that touch by chance are taken for an overlap. [0.01, 1].
  double least_overlap = 0.1;
  // Points taken of a scan at most, [1000, 1e6].
  int sample_points = 30000;
  absl::Status Validate() const;
};

// Two scans that have points in common.
struct PairFigures {
  int first = 0, second = 0;
  double overlap = 0;     // share of the points of one on the surface of the other, larger of both
  int64_t matches = 0;    // pairs of points
  double rms = 0;         // of their distances across the surface, scan unit
  double spread = 0;      // the same, as the median of the distances tells it
  double explained = 0;   // spread that noise and spacing of the two scans explain, scan unit
  bool overlaps = false;  // as much as is asked for
  bool fits = false;      // overlaps, with no more spread than is explained
  // For those that overlap and do not fit: whether they fit when no other scan is there.
  bool fits_alone = false;
};

struct Alignment {
  // By scan: aligned = moves[i] * point, scan unit. The first scan stays where it is.
  std::vector<Eigen::Isometry3d> moves;
  std::vector<PairFigures> pairs;  // that have matches
  // By scan: the lowest number among the scans that it hangs together with, by pairs that overlap.
  std::vector<int> group;
  double diagonal = 0;  // of all scans, scan unit
  int rounds = 0;
  bool converged = false;

  // One group, and all pairs that overlap fit.
  bool IsSound() const;
};

// All scans at once (Y. Chen and G. Medioni, "Object modelling by registration of multiple range
// images", 1992; P. Neugebauer, "Geometrical cloning of 3D objects via simultaneous registration of
// multiple range images", 1997): rounds of matching between each two scans (FindMatches) and one
// Gauss-Newton step for all poses, which minimises the squared distances of matches across the
// surface, each in the spread of its pair, with Tukey's weights. A loop closes in the same step. As
// a pair comes together its reach shrinks. Directions that no match tells stay as they are.
// Scans that do not come together are data in the result. Errors: INVALID_ARGUMENT for fewer than
// two scans and those of SampleScans; CANCELLED.
absl::StatusOr<Alignment> AlignScans(std::span<const PointCloud> scans,
                                     const AlignmentOptions& options, const RunContext& context);

// Moves points, stations and normals.
void MoveCloud(const Eigen::Isometry3d& move, PointCloud* cloud);

}  // namespace rilievo
