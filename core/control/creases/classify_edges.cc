#include "core/control/creases/classify_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Sides that meet flatter are no crease: cos 30 degrees.
constexpr double kSharpCosine = 0.866;
// Twice the log-likelihood ratio from which one edge speaks for itself, and along a run of edges.
constexpr double kStrongEvidence = 20;
constexpr double kWeakEvidence = 8;
// Standard errors that the points by an edge lie inside its corner from which it is rounded, and
// counts less: only where it leads on from a sure one.
constexpr double kBlunt = 1.5;
// Least cosine of an edge and the line along which its sides meet.
constexpr double kAligned = 0.85;
// Farthest that a line may run from the middle of its edge, in the edge's length and in spacings.
constexpr double kOffLength = 0.25;
constexpr double kOffSpacings = 2.5;
// An edge that moved less, in its length, and turned less (cos 5 degrees) is not classified again.
constexpr double kAlikeLength = 0.05, kAlikeCosine = 0.996;

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

EdgeClass VerdictOf(const TwoPlaneModel& planes, const EdgePlace& place, double length) {
  const double off = (planes.at - place.middle).norm();
  if (planes.cosine > kSharpCosine || std::abs(planes.direction.dot(place.along)) < kAligned ||
      off > std::min(kOffLength * length + planes.spacing, kOffSpacings * planes.spacing)) {
    return EdgeClass::kSmooth;
  }
  const bool blunt = planes.bluntness > kBlunt;
  if (planes.log_likelihood_ratio > kStrongEvidence)
    return blunt ? EdgeClass::kWeak : EdgeClass::kStrong;
  return planes.log_likelihood_ratio > kWeakEvidence && !blunt ? EdgeClass::kWeak
                                                               : EdgeClass::kSmooth;
}

// Whether both places would be classified alike.
bool Alike(const EdgePlace& a, const EdgePlace& b, double length) {
  return (a.middle - b.middle).norm() < kAlikeLength * length &&
         std::abs(a.along.dot(b.along)) > kAlikeCosine;
}

}  // namespace

EdgeClassification ClassifyEdge(const OrientedCloud& cloud, const PointIndex& index,
                                const FoldedEdge& edge, const EdgeClassification* before) {
  EdgeClassification judgement;
  const double length = (edge.q - edge.p).norm();
  if (!(length > 0)) return judgement;
  const EdgePlace place = PlaceOf(edge);
  if (before != nullptr && before->place && Alike(*before->place, place, length)) {
    judgement = *before;
  } else {
    judgement.place = place;
    judgement.planes = FitTwoPlaneModel(cloud, index, place);
  }
  judgement.edge_class =
      judgement.planes ? VerdictOf(*judgement.planes, place, length) : EdgeClass::kSmooth;
  return judgement;
}

absl::StatusOr<std::vector<EdgeClassification>> ClassifyEdges(const OrientedCloud& cloud,
                                                              const PointIndex& index,
                                                              const ControlMesh& mesh,
                                                              const MeshTopology& topology,
                                                              const EarlierClassifications& earlier,
                                                              const RunContext& context) {
  std::vector<EdgeClassification> judgements(static_cast<size_t>(topology.edge_count()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(topology.edge_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t e = begin; e < end; ++e) {
          if (topology.edge_faces(1, e) < 0) continue;
          const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
          FoldedEdge edge{mesh.vertices.col(a), mesh.vertices.col(b), {}, {}};
          for (int k = 0; k < 2; ++k) {
            const int face = topology.edge_faces(k, e);
            edge.normals[k] = FaceCross(mesh, face).normalized();
            edge.opposite[k] = mesh.vertices.col(OppositeCorner(mesh.faces, face, a, b));
          }
          if (edge.normals[0].dot(edge.normals[1]) > kLeastFold) continue;
          const auto before = earlier.find({a, b});
          judgements[e] =
              ClassifyEdge(cloud, index, edge, before == earlier.end() ? nullptr : &before->second);
        }
      }));
  return judgements;
}

int OppositeCorner(const Eigen::Matrix3Xi& faces, int face, int a, int b) {
  for (int k = 0; k < 3; ++k) {
    if (faces(k, face) != a && faces(k, face) != b) return faces(k, face);
  }
  return -1;
}

Vector3d FaceCross(const ControlMesh& mesh, int face) {
  const Vector3d a = mesh.vertices.col(mesh.faces(0, face));
  const Vector3d b = mesh.vertices.col(mesh.faces(1, face));
  const Vector3d c = mesh.vertices.col(mesh.faces(2, face));
  return (b - a).cross(c - a);
}

}  // namespace rilievo
