#include "core/control/creases/classify_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/control/creases/settings.h"
#include "core/geometry/vertex_normals.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// An edge between two faces: its ends, the faces' unit normals and the corners opposite to it.
struct FoldedEdge {
  Vector3d p, q;
  std::array<Vector3d, 2> normals, opposite;
};

EdgePlace PlaceOf(const FoldedEdge& edge) {
  EdgePlace place;
  place.middle = (edge.p + edge.q) / 2;
  place.along = (edge.q - edge.p).normalized();
  place.normal = edge.normals;
  for (int k = 0; k < 2; ++k) {
    const Vector3d way = edge.opposite[k] - place.middle;
    place.inward[k] = (way - place.along * place.along.dot(way)).normalized();
  }
  return place;
}

EdgeClass VerdictOf(const TwoPlaneModel& planes, const EdgePlace& place) {
  if (planes.cosine > std::cos(kCommon.sharp_angle) ||
      std::abs(planes.direction.dot(place.along)) < kClassifyEdges.aligned) {
    return EdgeClass::kSmooth;
  }
  const bool blunt = planes.bluntness > kClassifyEdges.blunt;
  if (planes.log_likelihood_ratio > kCommon.sure_evidence)
    return blunt ? EdgeClass::kWeak : EdgeClass::kStrong;
  return planes.log_likelihood_ratio > kClassifyEdges.weak_evidence && !blunt ? EdgeClass::kWeak
                                                                              : EdgeClass::kSmooth;
}

EdgeClassification ClassifyEdge(const OrientedCloud& cloud, const PointIndex& index,
                                const FoldedEdge& edge) {
  EdgeClassification judgement;
  if (!((edge.q - edge.p).norm() > 0)) return judgement;
  const EdgePlace place = PlaceOf(edge);
  judgement.planes = FitTwoPlaneModel(cloud, index, place);
  if (judgement.planes) judgement.edge_class = VerdictOf(*judgement.planes, place);
  return judgement;
}

}  // namespace

absl::StatusOr<std::vector<EdgeClassification>> ClassifyEdges(const OrientedCloud& cloud,
                                                              const PointIndex& index,
                                                              const ControlMesh& mesh,
                                                              const MeshTopology& topology,
                                                              const RunContext& context) {
  std::vector<EdgeClassification> judgements(static_cast<size_t>(topology.edge_count()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(topology.edge_count(), kHeavyBlock, context, [&](int64_t e) {
        if (topology.edge_faces(1, e) < 0) return;
        const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
        FoldedEdge edge{mesh.vertices.col(a), mesh.vertices.col(b), {}, {}};
        for (int k = 0; k < 2; ++k) {
          const int face = topology.edge_faces(k, e);
          edge.normals[k] = FaceCross(mesh.vertices, mesh.faces, face).normalized();
          const int opposite = kPreviousCorner[CornerOfEdge(topology, face, static_cast<int>(e))];
          edge.opposite[k] = mesh.vertices.col(mesh.faces(opposite, face));
        }
        if (edge.normals[0].dot(edge.normals[1]) > kClassifyEdges.least_fold) return;
        judgements[e] = ClassifyEdge(cloud, index, edge);
      }));
  return judgements;
}

}  // namespace rilievo
