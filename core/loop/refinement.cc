#include "core/loop/refinement.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/child_edges.h"
#include "core/loop/edge_star.h"
#include "core/loop/quad_surface.h"
#include "core/loop/subdivision_rules.h"

namespace rilievo {
namespace {

// The edges of the next level, numbered as MeshTopology demands.
struct ChildEdges {
  Eigen::Matrix2Xi halves;  // (i, e): the half of edge e at edge_vertices(i, e)
  Eigen::Matrix3Xi inner;   // (c, f)
};

ChildEdges NumberChildEdges(const MeshTopology& parent) {
  ChildEdges child;
  child.halves.resize(2, parent.edge_count());
  child.inner.resize(3, parent.face_count());
  int next = 0;
  ForEachChildEdge(
      parent,
      [&](int f, int k, int corner) {
        const int edge = parent.face_edges(k, f);
        child.halves(parent.edge_vertices(0, edge) != parent.faces(corner, f), edge) = next++;
      },
      [&](int f, int c) { child.inner(c, f) = next++; });
  return child;
}

// The two halves of a parent face's side k, as seen from the face: at its start and at its end.
struct SplitSide {
  int middle;  // vertex
  int edge_start, edge_end;
  int across_start, across_end;  // faces on the other side, -1 on the boundary
  bool first;                    // this face is the one that met the edge first
};

SplitSide SplitSideOfFace(const MeshTopology& parent, const ChildEdges& child_edges, int f, int k) {
  const int edge = parent.face_edges(k, f), neighbor = parent.face_neighbors(k, f);
  const int start = parent.edge_vertices(0, edge) != parent.faces(k, f);
  SplitSide side;
  side.middle = parent.vertex_count + edge;
  side.edge_start = child_edges.halves(start, edge);
  side.edge_end = child_edges.halves(1 - start, edge);
  side.first = parent.edge_faces(0, edge) == f;
  side.across_start = side.across_end = -1;
  if (neighbor >= 0) {
    const int j = CornerOfEdge(parent, neighbor, edge);  // the neighbour runs along it backwards
    side.across_start = 4 * neighbor + kNextCorner[j];
    side.across_end = 4 * neighbor + j;
  }
  return side;
}

// The four children of face f with corners v and edge vertices m.
void PutChildFaces(const Eigen::Vector3i& v, const Eigen::Vector3i& m, int f,
                   Eigen::Matrix3Xi& fine) {
  fine.middleCols<4>(4 * static_cast<Eigen::Index>(f)) << v[0], m[0], m[2], m[1],  //
      m[0], v[1], m[1], m[2],                                                      //
      m[2], m[1], v[2], m[0];
}

void RefineFace(const MeshTopology& parent, const ChildEdges& child_edges, int f,
                MeshTopology& fine) {
  const Eigen::Vector3i v = parent.faces.col(f);
  const Eigen::Vector3i inner = child_edges.inner.col(f);
  const std::array<SplitSide, 3> side = {SplitSideOfFace(parent, child_edges, f, 0),
                                         SplitSideOfFace(parent, child_edges, f, 1),
                                         SplitSideOfFace(parent, child_edges, f, 2)};
  const int center = 4 * f + 3;
  PutChildFaces(v, {side[0].middle, side[1].middle, side[2].middle}, f, fine.faces);
  fine.face_edges.middleCols<4>(4 * f) << side[0].edge_start, side[0].edge_end, inner[2], inner[2],
      inner[0], side[1].edge_start, side[1].edge_end, inner[0],  //
      side[2].edge_end, inner[1], side[2].edge_start, inner[1];
  fine.face_neighbors.middleCols<4>(4 * f) << side[0].across_start, side[0].across_end, center,
      4 * f + 2,                                                //
      center, side[1].across_start, side[1].across_end, 4 * f,  //
      side[2].across_end, center, side[2].across_start, 4 * f + 1;
  for (int k = 0; k < 3; ++k) {
    const int before = side[(k + 2) % 3].middle, after = side[k].middle;
    fine.edge_vertices.col(inner[k]) << std::min(before, after), std::max(before, after);
    fine.edge_faces.col(inner[k]) << 4 * f + k, center;
    if (!side[k].first) continue;
    fine.edge_vertices.col(side[k].edge_start) << v[k], after;
    fine.edge_vertices.col(side[k].edge_end) << v[(k + 1) % 3], after;
    fine.edge_faces.col(side[k].edge_start) << 4 * f + k, side[k].across_start;
    fine.edge_faces.col(side[k].edge_end) << 4 * f + (k + 1) % 3, side[k].across_end;
  }
}

absl::StatusOr<MeshTopology> RefineOnce(const MeshTopology& parent, const RunContext& context) {
  const ChildEdges child_edges = NumberChildEdges(parent);
  const int fine_faces = 4 * parent.face_count();
  const int fine_edges = 2 * parent.edge_count() + 3 * parent.face_count();
  MeshTopology fine = VerticesAfter(parent);
  fine.faces.resize(3, fine_faces);
  fine.face_edges.resize(3, fine_faces);
  fine.face_neighbors.resize(3, fine_faces);
  fine.edge_vertices.resize(2, fine_edges);
  fine.edge_faces.resize(2, fine_edges);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(parent.face_count(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t f = begin; f < end; ++f) {
          RefineFace(parent, child_edges, static_cast<int>(f), fine);
        }
      }));
  return fine;
}

}  // namespace

absl::StatusOr<LoopRefinement> RefineTopology(const ControlMesh& mesh, int max_level,
                                              const RunContext& context) {
  if (max_level < 0 || max_level > kMaxLoopLevel) {
    return absl::InvalidArgumentError(
        absl::StrCat("max_level is ", max_level, ", must be 0 to ", kMaxLoopLevel));
  }
  const int64_t finest_faces = static_cast<int64_t>(mesh.faces.cols()) << (2 * max_level);
  if (finest_faces > kMaxLoopFaces) {
    return absl::ResourceExhaustedError(
        absl::StrCat("level ", max_level, " of ", mesh.faces.cols(), " control faces has ",
                     finest_faces, " faces, at most ", kMaxLoopFaces, " are possible"));
  }
  LoopRefinement refinement;
  refinement.levels.reserve(static_cast<size_t>(max_level) + 1);
  RILIEVO_ASSIGN_OR_RETURN(MeshTopology control,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  refinement.levels.push_back(std::move(control));
  for (int level = 0; level < max_level; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(MeshTopology fine, RefineOnce(refinement.levels.back(), context));
    refinement.levels.push_back(std::move(fine));
  }
  if (mesh.quads()) {
    RILIEVO_ASSIGN_OR_RETURN(refinement.quads, RefineQuads(mesh, refinement.levels));
    refinement.sharp = SharpPartsOf(refinement.levels, refinement.quads);
    return refinement;
  }
  RILIEVO_ASSIGN_OR_RETURN(refinement.sharp, RefineCreases(mesh, refinement.levels));
  return refinement;
}

MeshTopology VerticesAfter(const MeshTopology& topology) {
  MeshTopology fine;
  fine.vertex_count = topology.vertex_count + topology.edge_count();
  fine.boundary_vertex.reserve(fine.vertex_count);
  fine.boundary_vertex = topology.boundary_vertex;
  fine.boundary_vertex.resize(fine.vertex_count, 0);
  fine.valence.reserve(fine.vertex_count);
  fine.valence = topology.valence;
  fine.valence.resize(fine.vertex_count, 6);
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (topology.edge_faces(1, e) >= 0) continue;
    fine.boundary_vertex[topology.vertex_count + e] = 1;
    fine.valence[topology.vertex_count + e] = 4;
  }
  return fine;
}

absl::StatusOr<LoopRefinement> RefineToVertices(const ControlMesh& mesh, int level,
                                                const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(LoopRefinement refinement,
                           RefineTopology(mesh, std::max(0, level - 1), context));
  if (level > 0) refinement.levels.push_back(VerticesAfter(refinement.levels.back()));
  return refinement;
}

Eigen::Matrix3Xi RefineFaces(const MeshTopology& topology) {
  Eigen::Matrix3Xi fine(3, 4 * static_cast<Eigen::Index>(topology.face_count()));
  for (int f = 0; f < topology.face_count(); ++f) {
    PutChildFaces(topology.faces.col(f), topology.face_edges.col(f).array() + topology.vertex_count,
                  f, fine);
  }
  return fine;
}

Eigen::Matrix3Xi FinestFaces(const LoopRefinement& refinement) {
  const int level = refinement.max_level();
  return level == 0 ? refinement.levels[0].faces : RefineFaces(refinement.levels[level - 1]);
}

Eigen::Matrix3Xd SubdivideOnce(const LoopRefinement& refinement, int level,
                               const Eigen::Matrix3Xd& values) {
  if (!refinement.quads.empty()) return SubdivideQuadsOnce(refinement, level, values);
  const MeshTopology& topology = refinement.levels[static_cast<size_t>(level)];
  const int vertex_count = topology.vertex_count;
  Eigen::Matrix3Xd ring_sums = Eigen::Matrix3Xd::Zero(3, vertex_count);
  Eigen::Matrix3Xd fine(3, vertex_count + topology.edge_count());
  for (int e = 0; e < topology.edge_count(); ++e) {
    const EdgeStar star = StarOfEdge(topology, e);
    // A boundary vertex follows its boundary neighbours alone.
    const bool boundary = star.boundary();
    if (boundary || !topology.boundary_vertex[star.from]) {
      ring_sums.col(star.from) += values.col(star.to);
    }
    if (boundary || !topology.boundary_vertex[star.to]) {
      ring_sums.col(star.to) += values.col(star.from);
    }
    fine.col(vertex_count + e) = EdgePoint(star, values);
  }
  for (int v = 0; v < vertex_count; ++v) {
    const VertexRule rule = RuleOfVertex(topology, v);
    fine.col(v) = rule.self * values.col(v) + rule.ring * ring_sums.col(v);
  }
  if (refinement.sharp.empty()) return fine;
  const SharpLevel& sharp = refinement.sharp.levels[static_cast<size_t>(level)];
  for (const SharpEdge& edge : sharp.edges) {
    fine.col(vertex_count + edge.edge) = SharpEdgePoint(topology, edge, values);
  }
  for (size_t i = 0; i < sharp.vertices.size(); ++i) {
    fine.col(sharp.vertices[i]) = SharpVertexPoint(sharp, i, values);
  }
  return fine;
}

}  // namespace rilievo
