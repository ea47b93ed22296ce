#include "core/control/creases/tag_creases.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/creases/classify_edges.h"
#include "core/control/creases/settings.h"
#include "core/control/simplify/collapse_guards.h"
#include "core/control/simplify/half_edge_mesh.h"
#include "core/control/simplify/quadric.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/points/point_support.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Weak edges stay where they lead on from a strong one.
std::vector<uint8_t> Tags(const MeshTopology& topology,
                          const std::vector<EdgeClassification>& judgements) {
  std::vector<uint8_t> tags(judgements.size(), 0), reached(topology.vertex_count, 0);
  for (size_t e = 0; e < tags.size(); ++e) {
    tags[e] = judgements[e].edge_class == EdgeClass::kStrong;
  }
  for (bool grown = true; grown;) {
    grown = false;
    for (size_t e = 0; e < tags.size(); ++e) {
      if (!tags[e]) continue;
      for (int k = 0; k < 2; ++k) reached[topology.edge_vertices(k, e)] = 1;
    }
    for (size_t e = 0; e < tags.size(); ++e) {
      if (tags[e] || judgements[e].edge_class != EdgeClass::kWeak) continue;
      if (!reached[topology.edge_vertices(0, e)] && !reached[topology.edge_vertices(1, e)])
        continue;
      tags[e] = 1;
      grown = true;
    }
  }
  return tags;
}

// Takes the tags off runs that say little; what they ended at may change its kind, so again.
absl::Status DropPoorRuns(const MeshTopology& topology,
                          const std::vector<EdgeClassification>& judgements, ControlMesh* mesh,
                          std::vector<uint8_t>* tags) {
  for (bool dropped = true; dropped;) {
    dropped = false;
    mesh->creases = TaggedEdges(topology, *tags);
    RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(*mesh, topology));
    for (const CreaseChain& chain : CreaseChains(topology, creases)) {
      double log_likelihood_ratio = 0;
      for (int edge : chain.edges)
        log_likelihood_ratio += judgements[edge].planes->log_likelihood_ratio;
      const double mean = log_likelihood_ratio / static_cast<double>(chain.edges.size());
      if (mean >= kTagCreases.run_evidence) continue;
      for (int edge : chain.edges) (*tags)[edge] = 0;
      dropped = true;
    }
  }
  return absl::OkStatus();
}

absl::Status MoveOntoCreases(const OrientedCloud& cloud, const PointIndex& index,
                             const MeshTopology& topology,
                             const std::vector<EdgeClassification>& judgements,
                             const std::vector<uint8_t>& tags, const RunContext& context,
                             ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const HalfEdgeMesh half_edges,
                           HalfEdgeMesh::Build(mesh->faces, topology.vertex_count, context));
  std::vector<Quadric> quadrics(static_cast<size_t>(topology.vertex_count));
  std::vector<double> reach(quadrics.size(), 0);
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (!tags[e]) continue;
    for (int k = 0; k < 2; ++k) {
      const int v = topology.edge_vertices(k, e);
      for (int side = 0; side < 2; ++side) {
        const HingePlane tangent = judgements[e].planes->TangentAt(side, mesh->vertices.col(v));
        quadrics[v].AddPlane(tangent.normal, tangent.offset * tangent.normal, 1);
      }
      reach[v] = std::max(reach[v], 3 * judgements[e].planes->spacing);
    }
  }
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (!(reach[v] > 0)) continue;
    const Vector3d from = mesh->vertices.col(v);
    quadrics[v].AddPoint(from, kTagCreases.stay);
    Vector3d way = quadrics[v].Minimum(from) - from;
    if (!way.allFinite()) continue;
    if (way.norm() > reach[v]) way *= reach[v] / way.norm();
    for (double share : {1.0, 0.5, 0.25}) {
      const Vector3d to = from + share * way;
      if (!KeepsFacesUpright(mesh->vertices, half_edges, v, to) ||
          !HasSupport(cloud, index, to, kTagCreases.reach_spacings))
        continue;
      mesh->vertices.col(v) = to;
      break;
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status TagCreases(const OrientedCloud& cloud, const PointIndex& index,
                        const RunContext& context, ControlMesh* mesh) {
  const ControlMesh given = *mesh;
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<EdgeClassification> judgements,
                           ClassifyEdges(cloud, index, *mesh, topology, context));
  std::vector<uint8_t> tags = Tags(topology, judgements);
  RILIEVO_RETURN_IF_ERROR(MoveOntoCreases(cloud, index, topology, judgements, tags, context, mesh));
  RILIEVO_RETURN_IF_ERROR(DropPoorRuns(topology, judgements, mesh, &tags));
  if (mesh->creases.empty()) *mesh = given;
  return absl::OkStatus();
}

}  // namespace rilievo
