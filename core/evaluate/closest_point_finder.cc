#include "core/evaluate/closest_point_finder.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/parallel_sort.h"
#include "core/base/status_macros.h"
#include "core/loop/face_vertices.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMostSteps = 32;
// A step shorter than this, of a side of a finest triangle, is the last.
constexpr double kShortStep = 1e-7;

// By how much the weight of each corner grows along a step in those of the second and third.
Vector3d WeightsOf(const Vector2d& step) { return {-step.sum(), step[0], step[1]}; }

// Along the edge opposite a corner.
Vector2d EdgeOpposite(int corner) {
  return corner == 0 ? Vector2d(-1, 1) : corner == 1 ? Vector2d(0, 1) : Vector2d(1, 0);
}

// Half the squared distance of a place as a function of the parameters, up to second order.
class DistanceModel {
 public:
  DistanceModel(const SurfaceJet& jet, const Vector3d& to_place) {
    slope_ = -Vector2d(jet.u.dot(to_place), jet.v.dot(to_place));
    const double uu = jet.u.squaredNorm(), uv = jet.u.dot(jet.v), vv = jet.v.squaredNorm();
    plane_ << uu, uv, uv, vv;
    const double bend = jet.uv.dot(to_place);
    whole_ << uu - jet.uu.dot(to_place), uv - bend, uv - bend, vv - jet.vv.dot(to_place);
  }

  // To its least point; where it has none, as far inside of a bend, to that of the tangent plane.
  Vector2d Step() const {
    constexpr double kPositive = 1e-3;  // of the tangent plane's determinant
    const double least = kPositive * plane_.determinant();
    const bool whole = whole_(0, 0) > 0 && whole_.determinant() > least;
    const Eigen::Matrix2d& bend = whole ? whole_ : plane_;
    const double determinant = bend.determinant();
    if (!(determinant > 0)) return Vector2d::Zero();
    return Vector2d(bend(0, 1) * slope_[1] - bend(1, 1) * slope_[0],
                    bend(0, 1) * slope_[0] - bend(0, 0) * slope_[1]) /
           determinant;
  }
  Vector2d StepAlong(const Vector2d& direction) const {
    double bend = direction.dot(whole_ * direction);
    if (!(bend > 0)) bend = direction.dot(plane_ * direction);
    if (!(bend > 0)) return Vector2d::Zero();
    return -direction.dot(slope_) / bend * direction;
  }

 private:
  Vector2d slope_;
  Eigen::Matrix2d plane_, whole_;
};

// The triangles that PatchLattice names by lattice points, of a face with n along a side.
std::vector<DisplacedEvaluator::FinestTriangle> LatticeTriangles(const Eigen::Matrix3Xi& lattice,
                                                                 int n) {
  std::vector<Eigen::Vector2i> points;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i + j <= n; ++i) points.push_back({i, j});
  }
  std::vector<DisplacedEvaluator::FinestTriangle> triangles;
  for (Eigen::Index t = 0; t < lattice.cols(); ++t) {
    const Eigen::Vector2i first = points[lattice(0, t)], second = points[lattice(1, t)];
    const bool turned = second[0] < first[0];
    triangles.push_back({0, first[0] - turned, first[1] - turned, turned});
  }
  return triangles;
}

// Places in an order in which neighbours are near each other: cell by cell of a grid over the unit
// frame. A search takes half the time where the one before it ended close by.
absl::StatusOr<std::vector<uint64_t>> OrderByCell(const Eigen::Matrix3Xd& places,
                                                  const SpatialFrame& frame,
                                                  const RunContext& context) {
  constexpr double kCells = 64;
  std::vector<uint64_t> order(static_cast<size_t>(places.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(places.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          const Vector3d unit = frame.UnitFromScan(places.col(i));
          uint64_t cell = 0;
          for (int axis = 0; axis < 3; ++axis) {
            const double at = std::clamp((unit[axis] + 0.5) * kCells, 0.0, kCells - 1);
            cell = cell * static_cast<uint64_t>(kCells) + static_cast<uint64_t>(at);
          }
          order[static_cast<size_t>(i)] = cell << 32 | static_cast<uint64_t>(i);
        }
      }));
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &order));
  for (uint64_t& place : order) place &= 0xffffffffu;
  return order;
}

}  // namespace

absl::StatusOr<ClosestPointFinder> ClosestPointFinder::Build(const DisplacedSurface& surface,
                                                             const RunContext& context) {
  ClosestPointFinder made;
  RILIEVO_ASSIGN_OR_RETURN(DisplacedVertices vertices, DisplaceVertices(surface, context));
  RILIEVO_ASSIGN_OR_RETURN(made.evaluator_,
                           DisplacedEvaluator::Build(surface, vertices.displacements, context));
  RILIEVO_ASSIGN_OR_RETURN(
      made.control_, BuildMeshTopology(surface.control_mesh.faces,
                                       static_cast<int>(surface.control_mesh.vertices.cols())));
  made.vertices_ = std::move(vertices.positions);
  const int level = surface.max_level, n = 1 << level;
  Eigen::Matrix3Xi lattice(3, 1);
  lattice << 0, 1, 2;
  if (level > 0) lattice = PatchLattice(level).triangles();
  made.lattice_ = LatticeTriangles(lattice, n);
  const FaceVertices vertices_of(made.control_, level);
  std::vector<int> of_face;
  made.triangles_.resize(3, made.control_.face_count() * lattice.cols());
  for (int f = 0; f < made.control_.face_count(); ++f) {
    vertices_of.Of(f, of_face);
    for (Eigen::Index t = 0; t < lattice.cols(); ++t) {
      for (int k = 0; k < 3; ++k) {
        made.triangles_(k, f * lattice.cols() + t) = of_face[lattice(k, t)];
      }
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(made.tree_,
                           ClosestPointTree::Over(made.vertices_, made.triangles_, context,
                                                  static_cast<int>(lattice.cols())));
  return made;
}

ClosestPointFinder::Foot ClosestPointFinder::FootOnTriangles(const Vector3d& place,
                                                             int* hint) const {
  *hint = tree_.Closest(place, *hint).item;
  const int triangle = tree_.source()[*hint], count = static_cast<int>(lattice_.size());
  const auto corners = triangles_.col(triangle);
  Foot foot = {lattice_[triangle % count],
               ClosestWeights(place, vertices_.col(corners[0]), vertices_.col(corners[1]),
                              vertices_.col(corners[2]))};
  foot.at.face = triangle / count;
  return foot;
}

bool ClosestPointFinder::Cross(int* opposite, Foot* foot) const {
  const int corner = *opposite;
  DisplacedEvaluator::FinestTriangle& at = foot->at;
  const int n = evaluator_.triangles_along_side();
  const bool on_control_edge = !at.turned && (corner == 0   ? at.i + at.j + 1 == n
                                              : corner == 1 ? at.i == 0
                                                            : at.j == 0);
  if (on_control_edge) return CrossControlEdge(opposite, foot);
  const int step = at.turned ? 1 : -1;
  if (corner == 1) at.i += step;
  if (corner == 2) at.j += step;
  at.turned = !at.turned;
  // The corners opposite the edge have the same number in both.
  std::swap(foot->weights[kNextCorner[corner]], foot->weights[kNextCorner[kNextCorner[corner]]]);
  return true;
}

bool ClosestPointFinder::CrossControlEdge(int* opposite, Foot* foot) const {
  const int from = kNextCorner[*opposite],
            face = foot->at.face;  // the edge runs from here to the next
  const int across = control_.face_neighbors(from, face);
  if (across < 0) return false;
  const int edge = control_.face_edges(from, face);
  int side = 0;
  while (control_.face_edges(side, across) != edge) ++side;
  const int n = evaluator_.triangles_along_side();
  // Triangles from the edge's start; the face across counts them from its end.
  const int here = from == 0 ? foot->at.i : from == 1 ? foot->at.j : n - 1 - foot->at.j;
  const int there = n - 1 - here;
  Vector3d weights = Vector3d::Zero();
  weights[side] = foot->weights[kNextCorner[from]];
  weights[kNextCorner[side]] = foot->weights[from];
  foot->weights = weights;
  foot->at = {across,
              side == 0   ? there
              : side == 1 ? n - 1 - there
                          : 0,
              side == 0   ? 0
              : side == 1 ? there
                          : n - 1 - there,
              false};
  return true;
}

ClosestPointFinder::Foot ClosestPointFinder::Polish(const Vector3d& place, Foot foot) const {
  constexpr double kOnEdge = 1e-12;
  Foot best = foot;
  double least = std::numeric_limits<double>::infinity(), before = least;
  bool nudged = false;
  Vector3d from = foot.weights, move = Vector3d::Zero();  // the last step
  int came_over = -1;  // the corner opposite the edge crossed last, without a step since
  for (int evaluation = 0; evaluation < kMostSteps; ++evaluation) {
    const SurfaceJet jet =
        evaluator_.UnitAtTriangle(foot.at, foot.weights.tail<2>(), JetOrder::kSecond);
    const Vector3d to_place = place - jet.position;
    const double squared = to_place.squaredNorm();
    if (came_over < 0 && squared >= before) {
      // Too far, where the model is poor.
      move *= 0.25;
      if (move.lpNorm<Eigen::Infinity>() < kShortStep) break;
      foot.weights = from + move;
      continue;
    }
    if (squared < least) best = foot;
    least = std::min(least, squared);
    before = squared;
    if (jet.irregular) {
      // No slope tells whether the vertex is the foot: one inside the triangle does.
      if (nudged) break;
      nudged = true;
      before = std::numeric_limits<double>::infinity();
      foot.weights = 0.9 * foot.weights + Vector3d::Constant(0.1 / 3);
      continue;
    }
    const DistanceModel model(jet, to_place);
    Vector2d step = model.Step();
    // Out of the triangle by an edge that the foot is on: into the next one, or along the edge
    // where the next one sends it back.
    bool crossed = false;
    for (int k = 0; k < 3 && !crossed; ++k) {
      if (foot.weights[k] > kOnEdge || WeightsOf(step)[k] >= 0) continue;
      int opposite = k;
      crossed = k != came_over && Cross(&opposite, &foot);
      if (crossed) {
        came_over = opposite;
      } else {
        step = model.StepAlong(EdgeOpposite(k));
      }
    }
    if (crossed) continue;
    came_over = -1;
    const Vector3d growth = WeightsOf(step);
    double share = 1;
    for (int k = 0; k < 3; ++k) {
      if (growth[k] < 0) share = std::min(share, std::max(0.0, foot.weights[k]) / -growth[k]);
    }
    from = foot.weights;
    move = (from + share * growth).cwiseMax(0.0) - from;
    foot.weights = from + move;
    // What the last step leaves is its square.
    if (share * step.lpNorm<Eigen::Infinity>() < kShortStep) return squared > least ? best : foot;
  }
  return best;
}

absl::StatusOr<std::vector<ClosestPoint>> ClosestPointFinder::Find(
    const Eigen::Matrix3Xd& places, const RunContext& context) const {
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    if (places.col(i).allFinite()) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("point ", i, " has a coordinate that is not finite"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint64_t> order,
                           OrderByCell(places, evaluator_.frame(), context));
  std::vector<ClosestPoint> found(static_cast<size_t>(places.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(places.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t rank = begin; rank < end; ++rank) {
          const auto i = static_cast<Eigen::Index>(order[static_cast<size_t>(rank)]);
          const Vector3d place = evaluator_.frame().UnitFromScan(places.col(i));
          const Foot foot = Polish(place, FootOnTriangles(place, &hint));
          const Vector2d at = evaluator_.ParametersOf(foot.at, foot.weights.tail<2>());
          const Vector3d position =
              evaluator_.At(foot.at.face, at[0], at[1], JetOrder::kPosition).position;
          found[static_cast<size_t>(i)] = {foot.at.face, at[0], at[1],
                                           (places.col(i) - position).norm(), position};
        }
      }));
  return found;
}

}  // namespace rilievo
