// Points spread evenly over the area of a triangle mesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace rilievo {

// Finalizer of SplitMix64 (Steele, Lea, Flood 2014): a counter in, 64 well-mixed bits out.
uint64_t MixBits(uint64_t x);

// `count` points (columns), each standing for the same share of the area: one in each of `count`
// equal slices of the running area over the triangles in the order `order` (all of them, each
// once), at a random place in it that depends on `seed` and the slice alone. So the spread is
// better than that of independent points, and points of neighbouring columns lie as close as
// neighbours in `order` do. Triangles without area get points only when none has any. `faces`,
// unless null, becomes the triangle of each point.
Eigen::Matrix3Xd SampleByArea(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                              std::span<const int> order, int64_t count, uint64_t seed,
                              std::vector<int>* faces = nullptr);

// The same of a piece of a mesh: one for each whole `slice` of its area, and one for what is left
// with the probability of its share of a slice. `faces` becomes the triangle of each.
Eigen::Matrix3Xd SamplePiece(const Eigen::Matrix3Xd& vertices, const Eigen::Matrix3Xi& triangles,
                             double slice, uint64_t seed, std::vector<int>* faces);

}  // namespace rilievo
