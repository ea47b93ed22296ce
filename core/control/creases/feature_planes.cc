#include "core/control/creases/feature_planes.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/control/creases/classify_edges.h"
#include "core/control/creases/settings.h"
#include "core/geometry/vertex_normals.h"
#include "core/points/neighborhood_size.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Replaces the plane of a face; leaves it where the points around show no side of their own.
void ShiftToSide(const OrientedCloud& cloud, const PointIndex& index, const Vector3d& center,
                 Vector3d* face_normal, Vector3d* face_point) {
  std::array<int, kFeaturePlanes.most_points> found;
  std::array<double, kFeaturePlanes.most_points> squared;
  index.Nearest(center, 1, found.data(), squared.data());
  const double spacing = cloud.spacing[found[0]], noise = cloud.noise[found[0]];
  const int wanted =
      NeighborhoodSize(kCommon.points_by_border, kFeaturePlanes.most_points, noise, spacing);
  const int count =
      index.Nearest(center, std::min(wanted, index.size()), found.data(), squared.data());
  // The nearest of the face's side.
  int seed = count;
  for (int i = 0; i < count; ++i) {
    if (cloud.normals.col(found[i]).dot(*face_normal) < kCommon.same_sheet) continue;
    if (seed == count || squared[i] < squared[seed]) seed = i;
  }
  if (seed == count) return;
  Vector3d normal = cloud.normals.col(found[seed]), point = cloud.points.col(found[seed]);
  for (int round = 0; round < kCommon.side_rounds; ++round) {
    const double width = (round == 0 ? 2.0 : 1.0) * std::max(2 * noise, 0.3 * spacing);
    Vector3d sum = Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    double weights = 0;
    int members = 0;
    for (int i = 0; i < count; ++i) {
      const double agreement = normal.dot(cloud.normals.col(found[i]));
      if (agreement < kCommon.same_side) continue;
      const Vector3d at = cloud.points.col(found[i]) - center;
      const double off = normal.dot(at + center - point) / width;
      if (off * off > 4) continue;
      const double fourth = agreement * agreement * agreement * agreement;
      const double weight = fourth * fourth * (1 - off * off / 4);
      sum += weight * at;
      squares += weight * at * at.transpose();
      weights += weight;
      ++members;
    }
    if (members < kCommon.fewest_of_plane) return;
    const Vector3d mean = sum / weights;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(squares / weights - mean * mean.transpose());
    if (!(solver.eigenvalues()[1] > 0.05 * solver.eigenvalues()[2])) return;
    const Vector3d axis = solver.eigenvectors().col(0);
    normal = axis.dot(normal) < 0 ? Vector3d(-axis) : axis;
    point = mean + center;
  }
  if (normal.dot(*face_normal) < kCommon.same_sheet) return;
  *face_normal = normal;
  *face_point = point;
}

}  // namespace

absl::StatusOr<FacePlanes> FeaturePlanes(const OrientedCloud& cloud, const PointIndex& index,
                                         const ControlMesh& mesh, const RunContext& context) {
  FacePlanes planes;
  planes.normals.setZero(3, mesh.faces.cols());
  planes.points.resize(3, mesh.faces.cols());
  const Eigen::Matrix3Xd vertex_normals = VertexNormals(mesh.vertices, mesh.faces);
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    planes.normals.col(f) = FaceCross(mesh.vertices, mesh.faces, f).normalized();
    const Eigen::Matrix3d corners = mesh.vertices(Eigen::all, mesh.faces.col(f));
    planes.points.col(f) = (corners.col(0) + corners.col(1) + corners.col(2)) / 3;
  }
  // Across a ring: a vertex is bent when a face around it leans from its normal.
  std::vector<uint8_t> bent(static_cast<size_t>(mesh.vertices.cols()), 0);
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int v = mesh.faces(k, f);
      if (vertex_normals.col(v).dot(planes.normals.col(f)) < kClassifyEdges.least_fold) bent[v] = 1;
    }
  }
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(mesh.faces.cols(), kHeavyBlock, context, [&](int64_t f) {
    if (!bent[mesh.faces(0, f)] && !bent[mesh.faces(1, f)] && !bent[mesh.faces(2, f)]) return;
    Vector3d normal = planes.normals.col(f), point = planes.points.col(f);
    if (normal.isZero()) return;
    ShiftToSide(cloud, index, planes.points.col(f), &normal, &point);
    planes.normals.col(f) = normal;
    planes.points.col(f) = point;
  }));
  return planes;
}

}  // namespace rilievo
