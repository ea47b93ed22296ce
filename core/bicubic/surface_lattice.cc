#include "core/bicubic/surface_lattice.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/loop/refinement.h"

namespace rilievo {

absl::StatusOr<SurfaceLattice> SurfaceLattice::Build(const DisplacedSurface& surface,
                                                     const RunContext& context) {
  if (surface.max_level < 0 || surface.max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level is ", surface.max_level, ", must be 0 to ", kMaxLoopLevel));
  }
  SurfaceLattice lattice;
  lattice.level_ = std::clamp(surface.max_level + 1, kLeastLevel, kMaxLoopLevel);
  while (lattice.level_ < kMaxLoopLevel &&
         int64_t{surface.control_mesh.faces.cols()} << 2 * (lattice.level_ + 1) <= kMostFaces) {
    ++lattice.level_;
  }
  RILIEVO_ASSIGN_OR_RETURN(LoopRefinement refinement,
                           RefineTopology(surface.control_mesh, lattice.level_, context));
  if (surface.heights.size() != static_cast<size_t>(refinement.vertex_count(surface.max_level))) {
    return absl::InvalidArgumentError(
        absl::StrCat("heights has ", surface.heights.size(), " entries, level ", surface.max_level,
                     " has ", refinement.vertex_count(surface.max_level), " vertices"));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      LimitSurface limit,
      EvaluateLimit(refinement, surface.control_mesh.vertices, lattice.level_, context));
  const std::vector<float> heights = HeightsAtLevel(surface, refinement, lattice.level_);
  lattice.points_ = std::move(limit.positions);
  for (Eigen::Index v = 0; v < lattice.points_.cols(); ++v) {
    lattice.points_.col(v) += double{heights[static_cast<size_t>(v)]} * limit.normals.col(v);
  }
  lattice.control_ = std::make_unique<MeshTopology>(std::move(refinement.levels.front()));
  lattice.face_vertices_ = std::make_unique<FaceVertices>(*lattice.control_, lattice.level_);
  return lattice;
}

Eigen::Vector3d PlaceSampler::At(const FacePlace& place) {
  if (faces_[0].face != place.face) {
    std::swap(faces_[0], faces_[1]);
    if (faces_[0].face != place.face) {
      faces_[0].face = place.face;
      lattice_.face_vertices_->Of(place.face, faces_[0].vertices);
    }
  }
  const int n = 1 << lattice_.level();
  const auto point = [&](int i, int j) {
    const int at = j * (n + 1) - j * (j - 1) / 2 + i;
    return lattice_.points_.col(faces_[0].vertices[static_cast<size_t>(at)]);
  };
  const double x = std::clamp(place.weights[1], 0.0, 1.0) * n,
               y = std::clamp(place.weights[2], 0.0, 1.0) * n;
  const int i = std::min(static_cast<int>(x), n - 1), j = std::min(static_cast<int>(y), n - 1 - i);
  const double u = x - i, v = y - j;
  if (u + v > 1 && i + j + 1 < n) {
    return (u + v - 1) * point(i + 1, j + 1) + (1 - u) * point(i, j + 1) +
           (1 - v) * point(i + 1, j);
  }
  return (1 - u - v) * point(i, j) + u * point(i + 1, j) + v * point(i, j + 1);
}

}  // namespace rilievo
