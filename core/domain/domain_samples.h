// Where the domain surface meets the data: the limit points of one refinement level.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/crease_topology.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"

namespace rilievo {

// The part of a fit that depends on connectivity alone. Sample i is vertex i of the refinement's
// finest level; the first `control_vertex_count()` samples are the limits of the control vertices.
struct DomainSamples {
  LoopRefinement refinement;  // of its finest level, unless that is the control mesh: faces alone
  LimitStencils stencils;     // one a sample
  VertexRings rings;          // around the samples, within the finest level
  VertexRings control_rings;  // around the control vertices: what their limits depend on
  VertexRings quad_edges;     // of quads: the neighbours along edges alone; of triangles empty
  std::vector<int> owned_begin;  // size control_face_count() + 1
  // Samples charged to control face f: [owned_begin[f], owned_begin[f + 1]). A sample on an edge or
  // a corner belongs to the first of its faces, so each sample counts once.
  std::vector<int> owned;
  std::vector<int> boundary_previous, boundary_next;  // along the boundary; -1 inside
  // Sides of sharp samples, see LimitStencils::sectors: side_begin[k] to side_begin[k + 1] are
  // those of sample sharp[k]. Both empty without creases.
  std::vector<int> sharp, side_begin;
  std::vector<VertexKind> control_kinds;
  std::vector<int> sharp_slot;  // a sample's place in `sharp`, or -1; empty without creases

  int size() const { return stencils.size(); }
  int control_vertex_count() const { return refinement.levels.front().vertex_count; }
  int control_face_count() const { return refinement.levels.front().face_count(); }
  const MeshTopology& finest() const { return refinement.levels.back(); }
  const VertexRings& edge_rings() const {
    return quad_edges.neighbor_begin.empty() ? control_rings : quad_edges;
  }
  bool is_sharp(int sample) const {
    return !sharp.empty() && sharp_slot[static_cast<size_t>(sample)] >= 0;
  }
  bool on_boundary(int sample) const { return boundary_next[static_cast<size_t>(sample)] >= 0; }
};

// INVALID_ARGUMENT unless `mesh` is a manifold.
absl::StatusOr<DomainSamples> BuildDomainSamples(const ControlMesh& mesh, int level,
                                                 const RunContext& context);

// The surface at the samples: columns as in DomainSamples.
struct SampledSurface {
  Eigen::Matrix3Xd positions;  // limit positions
  // Unit limit normals, outward, of sharp samples the normalised sum of their sides'; zero where
  // the surface is singular.
  Eigen::Matrix3Xd normals;
  Eigen::Matrix3Xd side_normals;  // column = unit normal of a side of a sharp sample
};

absl::Status SampleSurface(const DomainSamples& samples, const Eigen::Matrix3Xd& control_points,
                           const RunContext& context, SampledSurface* surface);

// Shares of the surface's area: each sums to one over its vertices. Equal shares for a surface
// without area.
struct AreaShares {
  double area = 0;                       // all of it, unit frame
  std::vector<double> samples;           // a third of the limit triangles around each sample
  std::vector<double> control_vertices;  // a third of the limit faces around each control vertex
};
AreaShares ShareArea(const DomainSamples& samples, const SampledSurface& surface);

}  // namespace rilievo
