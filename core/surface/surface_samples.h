// Points spread evenly over the area of a triangle mesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

// `count` points (columns), each standing for the same share of the area: one in each of `count`
// equal slices of the running area over the triangles in the order `order` (all of them, each
// once), at a random place in it that depends on `seed` and the slice alone. So the spread is
// better than that of independent points, and points of neighbouring columns lie as close as
// neighbours in `order` do. Triangles without area get points only when none has any. `faces`,
// unless null, becomes the triangle of each point.
Eigen::Matrix3Xd SampleByArea(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                              std::span<const int> order, int64_t count, uint64_t seed,
                              std::vector<int>* faces = nullptr);

// The same of a mesh that comes in pieces: a sample for each `slice` of the area that runs on over
// all of them.
class AreaSampler {
 public:
  AreaSampler(double slice, uint64_t seed) : slice_(slice), seed_(seed) {}

  // Those of the next piece. `faces` becomes the triangle of each.
  Eigen::Matrix3Xd Next(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                        std::vector<int>* faces);

 private:
  double slice_;
  uint64_t seed_;
  double before_ = 0;  // area so far
  int64_t count_ = 0;  // samples so far
};

}  // namespace rilievo
