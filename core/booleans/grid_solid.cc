#include "core/booleans/grid_solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/surface/mass_properties.h"

namespace rilievo {
namespace {

// A sharp tip moves so many times farther than its faces, at most.
constexpr double kMostAhead = 8;

absl::StatusOr<std::vector<uint32_t>> PartnersOf(const Eigen::Matrix3Xi& faces, int vertex_count,
                                                 const char* which) {
  std::vector<uint32_t> partner(static_cast<size_t>(3 * faces.cols()), kNoHalfEdge);
  int64_t open = 0, crowded = 0;
  ForEachEdge(faces, vertex_count, [&](int, int, const HalfEdgeGroup& group) {
    if (group.size() == 2 && Origin(faces, group[0]) != Origin(faces, group[1])) {
      partner[group[0]] = group[1];
      partner[group[1]] = group[0];
    } else {
      (group.size() == 1 ? open : crowded)++;
    }
  });
  if (open > 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("the ", which, " shape is open: ", open,
                     " of its edges have a triangle on one side only; solids are combined, so "
                     "close it first (reconstruct with --boundary close)"));
  }
  if (crowded > 0) {
    return absl::FailedPreconditionError(
        absl::StrCat("the ", which, " shape is no solid: at ", crowded,
                     " of its edges more than two triangles meet, or two that face different "
                     "sides; mend it first"));
  }
  return partner;
}

// By vertex: the shortest move that takes all faces around it outward by 1, or as near to that as a
// sharp tip allows. By projections onto one half-space after the other (C. Hildreth, "A quadratic
// programming procedure", 1957), so it does not depend on the sizes of the faces.
Eigen::Matrix3Xd OutwardMoves(const TriangleMesh& mesh) {
  constexpr int kMostSweeps = 200;
  constexpr double kShort = 1e-2;  // of 1, that a face may lack
  const auto count = static_cast<size_t>(3 * mesh.triangles.cols());
  std::vector<double> pushes(count, 0);  // by corner of a face, along its normal
  Eigen::Matrix3Xd moves = Eigen::Matrix3Xd::Zero(3, mesh.vertices.cols());
  Eigen::Matrix3Xd normals(3, mesh.triangles.cols());
  for (Eigen::Index t = 0; t < normals.cols(); ++t) {
    const Eigen::Vector3d origin = mesh.vertices.col(mesh.triangles(0, t));
    normals.col(t) = (mesh.vertices.col(mesh.triangles(1, t)) - origin)
                         .cross(mesh.vertices.col(mesh.triangles(2, t)) - origin)
                         .normalized();
  }
  bool moved = true;
  for (int sweep = 0; sweep < kMostSweeps && moved; ++sweep) {
    moved = false;
    for (size_t corner = 0; corner < count; ++corner) {
      const auto normal = normals.col(static_cast<Eigen::Index>(corner / 3));
      auto move = moves.col(mesh.triangles.data()[corner]);
      const double push = std::max(1 - normal.dot(move), -pushes[corner]);
      if (normal.isZero() || move.squaredNorm() > kMostAhead * kMostAhead) continue;
      moved = moved || std::abs(push) > kShort;
      pushes[corner] += push;
      move += push * normal;
    }
  }
  return moves;
}

absl::Status CheckSolid(const TriangleMesh& mesh, const char* which) {
  RILIEVO_ASSIGN_OR_RETURN(const MassProperties mass,
                           MassPropertiesOf(mesh.vertices, mesh.triangles));
  if (mass.volume > 0) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat(
      "the ", which, " shape ",
      mass.volume < 0 ? "is inside out: turn its triangles over" : "encloses no volume"));
}

}  // namespace

FloatBox GridSolid::BoxOf(int face) const {
  FloatBox box;
  for (const GridPoint& corner : TriangleOf(face)) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto at = static_cast<double>(corner.at[axis]);
      box.lo[axis] = std::min(box.lo[axis], FloatBox::RoundDown(at));
      box.hi[axis] = std::max(box.hi[axis], FloatBox::RoundUp(at));
    }
  }
  return box;
}

absl::StatusOr<std::array<GridSolid, 2>> PlaceOnGrid(const TriangleMesh& a, const TriangleMesh& b,
                                                     const Growth& growth) {
  const TriangleMesh* meshes[2] = {&a, &b};
  const char* names[2] = {"first", "second"};
  std::array<GridSolid, 2> solids;
  Eigen::Vector3d low = a.vertices.col(0), high = low;
  for (size_t side = 0; side < 2; ++side) {
    const TriangleMesh& mesh = *meshes[side];
    solids[side].faces = mesh.triangles;
    RILIEVO_ASSIGN_OR_RETURN(
        solids[side].partner,
        PartnersOf(mesh.triangles, static_cast<int>(mesh.vertices.cols()), names[side]));
    RILIEVO_RETURN_IF_ERROR(CheckSolid(mesh, names[side]));
    low = low.cwiseMin(mesh.vertices.rowwise().minCoeff());
    high = high.cwiseMax(mesh.vertices.rowwise().maxCoeff());
  }
  const Eigen::Vector3d center = (low + high) / 2;
  const double steps = static_cast<double>(kStepsOfHalfBox) / ((high - low) / 2).maxCoeff();
  uint32_t id = 0;
  for (size_t side = 0; side < 2; ++side) {
    const Eigen::Matrix3Xd& vertices = meshes[side]->vertices;
    Eigen::Matrix3Xd places = (vertices.colwise() - center) * steps;
    if (side == growth.side) places += growth.steps * OutwardMoves(*meshes[side]);
    for (const auto place : places.colwise()) {
      solids[side].points.push_back(
          {{std::llround(place.x()), std::llround(place.y()), std::llround(place.z())}, id++});
    }
  }
  return solids;
}

}  // namespace rilievo
