// The control mesh as bytes: connectivity by region growing, control points by prediction.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {

// A control mesh in steps of the position quantiser.
struct GridMesh {
  std::vector<GridPoint> points;
  Eigen::Matrix3Xi faces;
};

// The coding order: entry i of `vertices` (`corners`) is the vertex (half-edge 3 f + k: the face
// and which of its corners comes first) of the given mesh that is coded as number i.
struct CodingOrder {
  std::vector<int> vertices;
  std::vector<int> corners;
};

// The faces grow from face 0 with its corner 0 first, component after component in the order of
// their first faces. It depends on the faces alone; a mesh in coding order has itself as its order.
CodingOrder FindCodingOrder(const MeshTopology& topology);

// Bits of a coordinate of the unit frame in steps of `step` (> 0), [1, 28].
int SeedBits(double step);

// `points` and the faces of `topology` must be in coding order (INVALID_ARGUMENT). `seed_bits`:
// SeedBits of the step; both sides must say the same.
absl::StatusOr<std::vector<uint8_t>> EncodeControlMesh(const MeshTopology& topology,
                                                       const std::vector<GridPoint>& points,
                                                       int seed_bits);

// DATA_LOSS when the bytes make no such mesh. The caller has checked the counts against the bytes;
// whether the faces form a manifold is for BuildMeshTopology to say.
absl::StatusOr<GridMesh> DecodeControlMesh(std::span<const uint8_t> bytes, int vertex_count,
                                           int face_count, bool has_boundary, int seed_bits);

// The same of format version 1.
absl::StatusOr<GridMesh> DecodeControlMeshV1(std::span<const uint8_t> bytes, int vertex_count,
                                             int face_count, bool has_boundary);

}  // namespace rilievo
