// What stands behind a RilievoMesh.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "core/geometry/rgb.h"
#include "core/geometry/triangle_mesh.h"

// A column, or an entry, a vertex or triangle; what a mesh does not have is empty.
struct RilievoMesh {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;
  Eigen::Matrix3Xf normals;
  std::vector<uint8_t> flags;
  std::vector<rilievo::Rgb> colors;
  std::vector<int> numbers;
};

namespace rilievo::decoder_c {

// The mesh for C, which frees it.
RilievoMesh* WrapMesh(TriangleMesh mesh);

}  // namespace rilievo::decoder_c
