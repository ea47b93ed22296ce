#include "core/booleans/grid_solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
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

// Unit normals of the faces around each vertex, those of vertex v from begins[v].
struct NormalsAround {
  std::vector<size_t> begins;
  std::vector<Eigen::Vector3d> normals;
};

NormalsAround NormalsAroundVertices(const TriangleMesh& mesh) {
  NormalsAround around;
  around.begins.assign(static_cast<size_t>(mesh.vertices.cols()) + 1, 0);
  for (const int v : mesh.triangles.reshaped()) ++around.begins[static_cast<size_t>(v) + 1];
  std::partial_sum(around.begins.begin(), around.begins.end(), around.begins.begin());
  around.normals.resize(around.begins.back());
  std::vector<size_t> next(around.begins.begin(), around.begins.end() - 1);
  for (const auto triangle : mesh.triangles.colwise()) {
    const Eigen::Vector3d origin = mesh.vertices.col(triangle[0]);
    const Eigen::Vector3d normal = (mesh.vertices.col(triangle[1]) - origin)
                                       .cross(mesh.vertices.col(triangle[2]) - origin)
                                       .normalized();
    for (const int v : triangle) around.normals[next[static_cast<size_t>(v)]++] = normal;
  }
  return around;
}

// The shortest move of a vertex that takes all faces around it outward by 1, or as near to that as
// a sharp tip allows. By projections onto one half-space after the other (C. Hildreth, "A quadratic
// programming procedure", 1957), so it does not depend on the sizes of the faces.
Eigen::Vector3d OutwardMove(std::span<const Eigen::Vector3d> normals) {
  constexpr int kMostSweeps = 200;
  constexpr double kShort = 1e-2;  // of 1, that a face may lack
  std::vector<double> pushes(normals.size(), 0);
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  bool moved = true;
  for (int sweep = 0; sweep < kMostSweeps && moved; ++sweep) {
    moved = false;
    for (size_t i = 0; i < normals.size(); ++i) {
      const double push = std::max(1 - normals[i].dot(move), -pushes[i]);
      if (normals[i].isZero() || move.squaredNorm() > kMostAhead * kMostAhead) continue;
      moved = moved || std::abs(push) > kShort;
      pushes[i] += push;
      move += push * normals[i];
    }
  }
  return move;
}

absl::StatusOr<Eigen::Matrix3Xd> OutwardMoves(const TriangleMesh& mesh, const RunContext& context) {
  const NormalsAround around = NormalsAroundVertices(mesh);
  Eigen::Matrix3Xd moves(3, mesh.vertices.cols());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(moves.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t v = begin; v < end; ++v) {
          const size_t first = around.begins[static_cast<size_t>(v)];
          const size_t count = around.begins[static_cast<size_t>(v) + 1] - first;
          moves.col(v) = OutwardMove(std::span(around.normals).subspan(first, count));
        }
      }));
  return moves;
}

std::vector<GridPoint> GridPointsOf(const Eigen::Matrix3Xd& places, uint32_t first_id) {
  std::vector<GridPoint> points;
  points.reserve(static_cast<size_t>(places.cols()));
  for (const auto place : places.colwise()) {
    points.push_back(
        {{std::llround(place.x()), std::llround(place.y()), std::llround(place.z())}, first_id++});
  }
  return points;
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
                                                     const Growth& growth,
                                                     const RunContext& context) {
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
  uint32_t first_id = 0;
  for (size_t side = 0; side < 2; ++side) {
    const Eigen::Matrix3Xd places = (meshes[side]->vertices.colwise() - center) * steps;
    if (side == growth.side && growth.steps != 0) {
      RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd moves, OutwardMoves(*meshes[side], context));
      solids[side].points = GridPointsOf(places + growth.steps * moves, first_id);
      solids[side].points_otherwise = GridPointsOf(places - growth.steps * moves, first_id);
    } else {
      solids[side].points = GridPointsOf(places, first_id);
    }
    first_id += static_cast<uint32_t>(places.cols());
  }
  return solids;
}

}  // namespace rilievo
