#include "client/formats/tiles/tile_tree.h"

#include <algorithm>
#include <cmath>

#include "core/base/status_macros.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

std::vector<GridPoint> OnGrid(const Eigen::Matrix3Xd& unit_points) {
  constexpr double kSteps = 1 << 24;  // of the diagonal
  std::vector<GridPoint> points(static_cast<size_t>(unit_points.cols()));
  for (size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const double steps = std::round(unit_points(axis, static_cast<Eigen::Index>(i)) * kSteps);
      points[i][static_cast<size_t>(axis)] = static_cast<int32_t>(
          std::clamp<double>(steps, -double{kMaxCoordinate}, double{kMaxCoordinate}));
    }
  }
  return points;
}

// Of the largest distance between the middle of an edge of a control face at this level and the
// vertex that splits it, per control face.
std::vector<double> MidpointDistances(const TriangleMesh& coarse, const TriangleMesh& fine,
                                      Eigen::Index control_faces) {
  const Eigen::Index per_face = coarse.triangles.cols() / control_faces;
  std::vector<double> farthest(static_cast<size_t>(control_faces), 0);
  for (Eigen::Index t = 0; t < coarse.triangles.cols(); ++t) {
    // The middle one of its four: (m1, m2, m0), see LoopRefinement.
    const Eigen::Vector3i middle = fine.triangles.col(4 * t + 3);
    double& distance = farthest[static_cast<size_t>(t / per_face)];
    for (int k = 0; k < 3; ++k) {
      const int vertex = middle[kPreviousCorner[static_cast<size_t>(k)]];  // of edge k
      const int from = coarse.triangles(k, t);
      const int to = coarse.triangles(kNextCorner[static_cast<size_t>(k)], t);
      const Eigen::Vector3d center = (coarse.vertices.col(from) + coarse.vertices.col(to)) / 2;
      distance = std::max(distance, (fine.vertices.col(vertex) - center).norm());
    }
  }
  return farthest;
}

}  // namespace

absl::StatusOr<std::vector<SurfaceTile>> CutIntoTiles(const ControlMesh& control, int finest_level,
                                                      int64_t most_triangles) {
  RILIEVO_ASSIGN_OR_RETURN(
      const MeshTopology topology,
      BuildMeshTopology(control.faces, static_cast<int>(control.vertices.cols())));
  const std::vector<GridPoint> points = OnGrid(control.vertices);
  std::vector<SurfaceTile> tiles;
  std::vector<int> tile_of(static_cast<size_t>(control.faces.cols()), -1);  // the level before's
  for (int level = 0; level <= finest_level; ++level) {
    const int64_t faces = std::max<int64_t>(1, most_triangles >> (2 * level));
    const auto limit = static_cast<int>(std::min<int64_t>(faces, control.faces.cols()));
    FaceGroups groups = GroupFaces(topology, points, limit);
    for (std::vector<int>& members : groups.members) {
      const int number = static_cast<int>(tiles.size());
      const int parent = tile_of[static_cast<size_t>(members.front())];
      if (parent >= 0) tiles[static_cast<size_t>(parent)].children.push_back(number);
      for (const int face : members) tile_of[static_cast<size_t>(face)] = number;
      tiles.push_back({level, std::move(members), parent, {}, 0});
    }
  }
  return tiles;
}

void MeasureTiles(const std::vector<TriangleMesh>& levels, std::vector<SurfaceTile>* tiles) {
  const Eigen::Index control_faces = levels.front().triangles.cols();
  for (size_t level = 0; level + 1 < levels.size(); ++level) {
    const std::vector<double> distances =
        MidpointDistances(levels[level], levels[level + 1], control_faces);
    for (SurfaceTile& tile : *tiles) {
      double farthest = 0;
      for (const int face : tile.faces) {
        farthest = std::max(farthest, distances[static_cast<size_t>(face)]);
      }
      tile.spread += farthest;
      if (tile.level <= static_cast<int>(level)) tile.error += farthest;
    }
  }
}

}  // namespace rilievo
