// Two-sided distance between surfaces and point sets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

// One direction. Unit of the inputs' own frame.
struct DistanceSummary {
  double rms = 0, mean = 0, p95 = 0, max = 0;
  int64_t samples = 0;
};

struct TwoSidedError {
  DistanceSummary a_to_b, b_to_a;
  double rms = 0;   // sqrt of the mean of both mean squares
  double mean = 0;  // of both means
  double p95 = 0;   // of both sample sets pooled
  double max = 0;   // the larger maximum
  // The larger RMS of both ways, where b has triangles, or is a point set with `gaps`; there, of a
  // sample of a that has its nearest point no farther off than that along the surface, only the
  // distance across the surface counts: the part along the normal of a's triangle (point-to-plane
  // distance, D2 of MPEG's point cloud metrics; Tian et al., ICIP 2017). So points that are far
  // apart are no error of the surface; parts of it that no points are near to are, by their whole
  // distance. Beside a sharp edge the nearest point may lie on its other side: with `normals`,
  // where the four nearest points show sides whose planes meet at 30 degrees or more, the distance
  // from the plane of the nearest point of each side counts instead where it is less and that point
  // no farther off along the plane than a third of its gap. Samples of triangles of a that are
  // `filled` do not count. -1 for points without gaps.
  double across_rms = -1;
};

// A surface (triangles) or a bare point set (`triangles` empty).
struct Shape {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi triangles;
  // Of a point set: how far from each point a surface through it counts as seen. Empty: not known.
  std::vector<float> gaps = {};
  Eigen::Matrix3Xd normals = {};  // of a point set: unit, of either sign, one a point or none
  // Of a surface: by vertex, whether it was made where nothing tells of it. A triangle of three
  // such is filled. Empty: none.
  std::vector<uint8_t> filled = {};
  int children_per_face = 1;  // of the triangles, as for ClosestPointTree: makes a search quicker
};

struct MeasureOptions {
  int samples =
      200000;  // area-weighted samples a surface, [1000, 10^7]; a point set uses its points
  absl::Status Validate() const;
};

// Exact closest-point distances (own bounding-volume tree over triangles or points), both ways.
// INVALID_ARGUMENT when a shape is empty or not finite, or has gaps, normals or marks of
// filled vertices that are not one for each.
absl::StatusOr<TwoSidedError> MeasureTwoSided(const Shape& a, const Shape& b,
                                              const MeasureOptions& options,
                                              const RunContext& context);

// A shape that many others are measured against, with its tree. The errors of MeasureTwoSided.
struct SearchableShape {
  Shape shape;
  ClosestPointTree tree;
};
absl::StatusOr<SearchableShape> MakeSearchable(Shape shape, const RunContext& context);

// MeasureTwoSided, bit for bit.
absl::StatusOr<TwoSidedError> MeasureAgainst(const Shape& a, const SearchableShape& b,
                                             const MeasureOptions& options,
                                             const RunContext& context);

// One direction of it: from samples and vertices of `from`, or its points, to `to`. Quickest where
// neighbours in the numbering of `from` are neighbours in space.
absl::StatusOr<DistanceSummary> MeasureOneSided(const Shape& from, const Shape& to,
                                                const MeasureOptions& options,
                                                const RunContext& context);

}  // namespace rilievo
