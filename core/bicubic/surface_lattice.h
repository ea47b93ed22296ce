// A displaced surface at any place of a control face, from the vertices of one level.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/bicubic/patch_domains.h"
#include "core/loop/face_vertices.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// The vertices of the level after the finest one, or of a later one that has no more than
// kMostFaces.
class SurfaceLattice {
 public:
  static constexpr int64_t kMostFaces = int64_t{1} << 17;
  static constexpr int kLeastLevel = 3;

  // `surface` is not needed afterwards. INVALID_ARGUMENT and RESOURCE_EXHAUSTED as Tessellate().
  static absl::StatusOr<SurfaceLattice> Build(const DisplacedSurface& surface,
                                              const RunContext& context);

  int level() const { return level_; }

 private:
  friend class PlaceSampler;
  int level_ = 0;
  std::unique_ptr<MeshTopology> control_;
  std::unique_ptr<FaceVertices> face_vertices_;
  Eigen::Matrix3Xd points_;  // unit frame
};

// Asks it for places, face after face; one for each thread. `lattice` is kept by reference.
class PlaceSampler {
 public:
  explicit PlaceSampler(const SurfaceLattice& lattice) : lattice_(lattice) {}
  // On the triangle of the level between its three vertices; unit frame.
  Eigen::Vector3d At(const FacePlace& place);

 private:
  struct Face {
    int face = -1;
    std::vector<int> vertices;
  };
  const SurfaceLattice& lattice_;
  std::array<Face, 2> faces_;  // asked for last: a quad has two
};

}  // namespace rilievo
