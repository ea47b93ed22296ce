#include "core/surface/displaced_surface.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/large_pages.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/geometry/vertex_normals.h"
#include "core/loop/loop_patches.h"
#include "core/loop/refinement.h"
#include "core/surface/edge_stencil.h"
#include "core/surface/patch_mesh.h"

namespace rilievo {
namespace {

constexpr int kLevelsBeyond = 2;

absl::Status CheckSurface(const DisplacedSurface& surface, int level) {
  if (surface.max_level < 0 || surface.max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level is ", surface.max_level, ", must be 0 to ", kMaxLoopLevel));
  }
  if (level < 0 || level > surface.max_level + kLevelsBeyond) {
    return absl::InvalidArgumentError(absl::StrCat("level is ", level, ", this surface has 0 to ",
                                                   surface.max_level + kLevelsBeyond));
  }
  if (surface.sources.size() != surface.heights.size()) {
    return absl::InvalidArgumentError(absl::StrCat("sources has ", surface.sources.size(),
                                                   " entries, heights ", surface.heights.size()));
  }
  return absl::OkStatus();
}

// Of a level, from the counts of the control mesh alone.
int64_t VertexCount(const MeshTopology& control, int level) {
  int64_t vertices = control.vertex_count, edges = control.edge_count(),
          faces = control.face_count();
  for (int l = 0; l < level; ++l) {
    vertices += edges;
    edges = 2 * edges + 3 * faces;
    faces *= 4;
  }
  return vertices;
}

// A height for the new vertex of `edge`: the butterfly's 8-point rule where its whole stencil is
// there (it interpolates and reproduces cubics on a regular mesh), the mean of the ends elsewhere.
float InterpolatedHeight(const MeshTopology& topology, int edge,
                         const std::vector<float>& heights) {
  const EdgeStencil stencil = StencilOfEdge(topology, edge);
  const double middle = 0.5 * (heights[stencil.ends[0]] + heights[stencil.ends[1]]);
  if (!stencil.complete()) return static_cast<float>(middle);
  double opposite = 0, wings = 0;
  for (int v : stencil.opposite) opposite += heights[v];
  for (int v : stencil.wings) wings += heights[v];
  return static_cast<float>(middle + opposite / 8 - wings / 16);
}

// Patches are those of Loop surfaces.
bool HasPatches(const DisplacedSurface& surface, int level) {
  return level >= LoopPatches::kLeastLevel && !surface.control_mesh.quads();
}

absl::Status CheckHeightCount(const DisplacedSurface& surface, int64_t expected) {
  if (static_cast<int64_t>(surface.heights.size()) == expected) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("heights has ", surface.heights.size(),
                                                 " entries, level ", surface.max_level, " has ",
                                                 expected, " vertices"));
}

// A level whose heights are all given, by patches. Unit frame.
absl::StatusOr<TriangleMesh> TessellatePatches(const DisplacedSurface& surface, int level,
                                               bool with_normals, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const LoopPatches patches,
                           LoopPatches::Build(surface.control_mesh, level, context));
  RILIEVO_RETURN_IF_ERROR(
      CheckHeightCount(surface, VertexCount(patches.control(), surface.max_level)));
  Eigen::Matrix3Xd vertices(3, patches.numbering().vertex_count());
  HintLargePages(vertices.data(), sizeof(double) * vertices.size());
  RILIEVO_RETURN_IF_ERROR(
      patches.Evaluate(context, [&](int first, std::span<const LimitPoint> points) {
        for (const LimitPoint& point : points) {
          vertices.col(first) = point.position + double{surface.heights[first]} * point.normal;
          ++first;
        }
      }));
  return MeshOfPatches(patches, std::move(vertices), with_normals, context);
}

// Any level, by its whole topology. Unit frame.
absl::StatusOr<TriangleMesh> TessellateTopology(const DisplacedSurface& surface, int level,
                                                bool with_normals, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      const LoopRefinement refinement,
      RefineTopology(surface.control_mesh, std::max(level, surface.max_level), context));
  RILIEVO_RETURN_IF_ERROR(
      CheckHeightCount(surface, refinement.levels[surface.max_level].vertex_count));
  RILIEVO_ASSIGN_OR_RETURN(
      LimitSurface limit, EvaluateLimit(refinement, surface.control_mesh.vertices, level, context));
  const std::vector<float> heights = HeightsAtLevel(surface, refinement, level);
  TriangleMesh mesh;
  mesh.vertices = std::move(limit.positions);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.col(v) += double{heights[v]} * limit.normals.col(v);
  }
  mesh.triangles = refinement.levels[level].faces;
  if (with_normals) mesh.normals = VertexNormals(mesh.vertices, mesh.triangles);
  return mesh;
}

}  // namespace

std::vector<float> HeightsAtLevel(const DisplacedSurface& surface, const LoopRefinement& refinement,
                                  int level) {
  std::vector<float> heights = surface.heights;
  for (int l = surface.max_level; l < level; ++l) {
    const MeshTopology& topology = refinement.levels[l];
    std::vector<float> finer = heights;
    finer.reserve(heights.size() + topology.edge_count());
    for (int edge = 0; edge < topology.edge_count(); ++edge) {
      finer.push_back(InterpolatedHeight(topology, edge, heights));
    }
    heights = std::move(finer);
  }
  heights.resize(refinement.vertex_count(level));
  return heights;
}

absl::StatusOr<TriangleMesh> TessellateInUnitFrame(const DisplacedSurface& surface, int level,
                                                   bool with_normals, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckSurface(surface, level));
  const bool by_patches = HasPatches(surface, level) && level <= surface.max_level;
  return by_patches ? TessellatePatches(surface, level, with_normals, context)
                    : TessellateTopology(surface, level, with_normals, context);
}

absl::StatusOr<TriangleMesh> Tessellate(const DisplacedSurface& surface, int level,
                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(TriangleMesh mesh,
                           TessellateInUnitFrame(surface, level, /*with_normals=*/true, context));
  // Normals were taken in the unit frame, where the scan's own offset has not yet cost any digits.
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(mesh.vertices.cols(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t v = begin; v < end; ++v) {
          mesh.vertices.col(v) = surface.frame.ScanFromUnit(mesh.vertices.col(v));
        }
      }));
  return mesh;
}

absl::StatusOr<DisplacedVertices> DisplaceVertices(const DisplacedSurface& surface,
                                                   const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckSurface(surface, surface.max_level));
  DisplacedVertices vertices;
  const auto resize = [&](Eigen::Index count) {
    vertices.positions.resize(3, count);
    vertices.displacements.resize(3, count);
  };
  const auto place = [&](Eigen::Index v, const auto& position, const auto& normal) {
    vertices.displacements.col(v) = double{surface.heights[v]} * normal;
    vertices.positions.col(v) = position + vertices.displacements.col(v);
  };
  const int level = surface.max_level;
  if (!HasPatches(surface, level)) {
    RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                             RefineTopology(surface.control_mesh, level, context));
    RILIEVO_RETURN_IF_ERROR(CheckHeightCount(surface, refinement.levels[level].vertex_count));
    RILIEVO_ASSIGN_OR_RETURN(
        const LimitSurface limit,
        EvaluateLimit(refinement, surface.control_mesh.vertices, level, context));
    resize(limit.positions.cols());
    for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
      place(v, limit.positions.col(v), limit.normals.col(v));
    }
    return vertices;
  }
  RILIEVO_ASSIGN_OR_RETURN(const LoopPatches patches,
                           LoopPatches::Build(surface.control_mesh, level, context));
  RILIEVO_RETURN_IF_ERROR(CheckHeightCount(surface, VertexCount(patches.control(), level)));
  resize(patches.numbering().vertex_count());
  RILIEVO_RETURN_IF_ERROR(
      patches.Evaluate(context, [&](int first, std::span<const LimitPoint> points) {
        for (const LimitPoint& point : points) place(first++, point.position, point.normal);
      }));
  return vertices;
}

namespace {

// What `values` say at `level`; beyond max_level `append` adds the values of new vertices. Empty
// where Tessellate would fail.
template <typename T, typename Append>
std::vector<T> ValuesAtLevel(const DisplacedSurface& surface, std::vector<T> values, int level,
                             const Append& append) {
  if (!CheckSurface(surface, level).ok()) return {};
  const absl::StatusOr<LoopRefinement> refinement =
      RefineTopology(surface.control_mesh, level, RunContext());
  if (!refinement.ok()) return {};
  if (level >= surface.max_level &&
      static_cast<int64_t>(values.size()) != refinement->levels[surface.max_level].vertex_count) {
    return {};
  }
  for (int l = surface.max_level; l < level; ++l) append(refinement->levels[l], &values);
  const size_t count = static_cast<size_t>(refinement->levels[level].vertex_count);
  if (values.size() < count) return {};
  values.resize(count);
  return values;
}

}  // namespace

std::vector<HeightSource> SourcesAtLevel(const DisplacedSurface& surface, int level) {
  const auto append = [](const MeshTopology& topology, std::vector<HeightSource>* sources) {
    for (int edge = 0; edge < topology.edge_count(); ++edge) {
      sources->push_back(std::max((*sources)[topology.edge_vertices(0, edge)],
                                  (*sources)[topology.edge_vertices(1, edge)]));
    }
  };
  return ValuesAtLevel(surface, surface.sources, level, append);
}

std::vector<Rgb> ColorsAtLevel(const DisplacedSurface& surface, int level) {
  return ValuesAtLevel(surface, surface.colors, level, AppendMeanColors);
}

void AppendMeanColors(const MeshTopology& topology, std::vector<Rgb>* colors) {
  for (int edge = 0; edge < topology.edge_count(); ++edge) {
    const Rgb a = (*colors)[topology.edge_vertices(0, edge)];
    const Rgb b = (*colors)[topology.edge_vertices(1, edge)];
    Rgb& mean = colors->emplace_back();
    for (size_t k = 0; k < mean.size(); ++k) mean[k] = static_cast<uint8_t>((a[k] + b[k] + 1) / 2);
  }
}

}  // namespace rilievo
