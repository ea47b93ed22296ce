// Distances of many places from a shape, and what is told of them.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/parallel_for.h"
#include "core/base/run_context.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// Squared distance of the points at(0) to at(count - 1). Each block starts without a hint, which
// costs little and leaves the blocks independent of the threads.
template <typename PointAt>
absl::StatusOr<std::vector<double>> SquaredDistances(int64_t count, const PointAt& at,
                                                     const ClosestPointTree& tree,
                                                     const RunContext& context) {
  std::vector<double> squared(static_cast<size_t>(count));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t i = begin; i < end; ++i) {
          const ClosestPointTree::Hit hit = tree.Closest(at(i), hint);
          squared[i] = hit.squared_distance;
          hint = hit.item;
        }
      }));
  return squared;
}

// The largest of `least` and the squared distances. Points that the item of one before keeps below
// the largest so far are not searched for.
template <typename PointAt>
absl::StatusOr<double> LargestSquaredDistance(int64_t count, const PointAt& at,
                                              const ClosestPointTree& tree, double least,
                                              const RunContext& context) {
  std::vector<double> largest(static_cast<size_t>((count + kSearchBlock - 1) / kSearchBlock),
                              least);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kSearchBlock, context, [&](int64_t begin, int64_t end) {
        double& block = largest[begin / kSearchBlock];
        int hint = -1;
        for (int64_t i = begin; i < end; ++i) {
          const Eigen::Vector3d point = at(i);
          if (hint >= 0 && tree.SquaredDistanceTo(hint, point) <= block) continue;
          const ClosestPointTree::Hit hit = tree.Closest(point, hint);
          block = std::max(block, hit.squared_distance);
          hint = hit.item;
        }
      }));
  return largest.empty() ? least : *std::max_element(largest.begin(), largest.end());
}

// Distance below which 95 of 100 values lie. Reorders `distances`.
double Percentile95(std::vector<double>& distances);

// Samples of a surface, and the triangle of each.
struct SurfaceSamples {
  Eigen::Matrix3Xd places;
  std::vector<int> faces;
};

// Whether all corners of the face are.
bool IsFilled(const Shape& shape, int face);

// How far `place` lies across the surface from a point, squared: from the plane through it, or from
// the point itself where that is farther off along the plane than `reach`. `normal`: unit.
double SquaredAcross(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double reach,
                     const Eigen::Vector3d& place);

// Squared distances of samples of `from` from a cloud with gaps; `across` becomes the squares whose
// mean, over faces that are not filled, is that of TwoSidedError::across_rms.
absl::StatusOr<std::vector<double>> SquaredAcrossCloud(
    const Shape& from, const SurfaceSamples& samples, const Shape& to,
    const ClosestPointTree& to_tree, const RunContext& context, std::vector<double>* across);

}  // namespace rilievo
