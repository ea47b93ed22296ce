#include "core/surface/part_triangles.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/loop/patch_lattice.h"
#include "core/loop/refinement.h"
#include "core/surface/count_folds.h"

namespace rilievo {
namespace {

// The triangles of the faces asked for, over the vertices of the part.
Eigen::Matrix3Xi InnerTriangles(const SurfacePart& part, const MeshTopology& control) {
  const int level = part.surface.max_level;
  const auto count = static_cast<Eigen::Index>(part.inner.size());
  if (level == 0) return control.faces(Eigen::all, part.inner);
  const PatchLattice lattice(level);
  const FaceVertices vertices(control, level);
  const Eigen::Matrix3Xi& local = lattice.triangles();
  Eigen::Matrix3Xi triangles(3, local.cols() * count);
  std::vector<int> of_face;
  for (Eigen::Index i = 0; i < count; ++i) {
    vertices.Of(part.inner[i], of_face);
    triangles.middleCols(i * local.cols(), local.cols()) =
        local.unaryExpr([&](int v) { return of_face[v]; });
  }
  return triangles;
}

std::array<int64_t, 3> CountSources(const SurfacePart& part, const MeshTopology& control) {
  const int level = part.surface.max_level;
  std::vector<int> first(control.vertex_count);
  for (int f = control.face_count() - 1; f >= 0; --f) {
    for (const int v : control.faces.col(f)) first[v] = f;
  }
  const FaceVertices vertices(control, level);
  std::array<int64_t, 3> counts{};
  std::vector<int> of_face;
  for (const int f : part.inner) {
    vertices.Of(f, of_face);
    for (int k = 0; k < 3 && level > 0; ++k) {
      const int neighbor = control.face_neighbors(k, f);
      if (neighbor < 0 || neighbor > f) continue;
      for (const int p : vertices.Side(k)) of_face[p] = -1;
    }
    for (const int v : of_face) {
      if (v < 0 || (v < control.vertex_count && first[v] != f)) continue;
      ++counts[static_cast<size_t>(part.surface.sources[v])];
    }
  }
  return counts;
}

}  // namespace

absl::StatusOr<PartTriangles> TrianglesOfPart(const SurfacePart& part, const RunContext& context) {
  const DisplacedSurface& surface = part.surface;
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(0, surface.max_level - 1), context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LimitSurface limit,
      EvaluateLimit(refinement, surface.control_mesh.vertices, surface.max_level, context));
  PartTriangles made;
  Shape& shape = made.shape;
  shape.triangles = InnerTriangles(part, refinement.levels.front());
  std::vector<int> number(surface.heights.size(), -1), kept;
  for (int& v : shape.triangles.reshaped()) {
    if (number[v] < 0) {
      number[v] = static_cast<int>(kept.size());
      kept.push_back(v);
    }
    v = number[v];
  }
  LimitSurface under;
  under.positions = limit.positions(Eigen::all, kept);
  under.normals = limit.normals(Eigen::all, kept);
  shape.vertices.resize(3, static_cast<Eigen::Index>(kept.size()));
  shape.filled.resize(kept.size());
  for (size_t i = 0; i < kept.size(); ++i) {
    const auto v = static_cast<Eigen::Index>(i);
    shape.vertices.col(v) =
        under.positions.col(v) + double{surface.heights[kept[i]]} * under.normals.col(v);
    shape.filled[i] = surface.sources[kept[i]] == HeightSource::kFilled;
  }
  shape.children_per_face = 1 << (2 * surface.max_level);
  RILIEVO_ASSIGN_OR_RETURN(made.folds, CountFolds(under, shape.vertices, shape.triangles, context));
  made.source_counts = CountSources(part, refinement.levels.front());
  return made;
}

}  // namespace rilievo
