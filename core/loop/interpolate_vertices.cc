#include "core/loop/interpolate_vertices.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/loop/crease_topology.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// What a step of subdivision leaves of the tags: each half of a crease is one less sharp.
ControlMesh Refined(const ControlMesh& mesh, const LoopRefinement& refinement) {
  const MeshTopology& topology = refinement.levels.front();
  ControlMesh finer;
  finer.vertices = SubdivideOnce(refinement, 0, mesh.vertices);
  finer.faces = RefineFaces(topology);
  finer.corners = mesh.corners;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
    const auto at = std::lower_bound(mesh.creases.begin(), mesh.creases.end(), std::pair(a, b),
                                     [](const Crease& crease, const std::pair<int, int>& ends) {
                                       return std::pair(crease.a, crease.b) < ends;
                                     });
    if (at == mesh.creases.end() || at->a != a || at->b != b) continue;
    const float left = at->sharpness >= kInfiniteSharpness ? at->sharpness : at->sharpness - 1;
    if (left <= 0) continue;
    const int middle = topology.vertex_count + e;
    finer.creases.push_back({a, middle, left});
    finer.creases.push_back({b, middle, left});
  }
  std::sort(finer.creases.begin(), finer.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  return finer;
}

// By vertex: the neighbours whose mean it is compared with.
class Umbrellas {
 public:
  static absl::StatusOr<Umbrellas> Of(const ControlMesh& mesh, const MeshTopology& topology) {
    RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(mesh, topology));
    std::vector<uint8_t> sharp(static_cast<size_t>(topology.edge_count()), 0);
    for (const SharpEdge& edge : creases.edges) sharp[static_cast<size_t>(edge.edge)] = 1;
    std::vector<std::vector<int>> neighbors(static_cast<size_t>(topology.vertex_count));
    for (int e = 0; e < topology.edge_count(); ++e) {
      const bool line = sharp[static_cast<size_t>(e)] != 0 || topology.edge_faces(1, e) < 0;
      for (int side = 0; side < 2; ++side) {
        const int v = topology.edge_vertices(side, e);
        const VertexKind kind = creases.kinds[static_cast<size_t>(v)];
        const bool smooth = kind == VertexKind::kSmooth || kind == VertexKind::kDart;
        if (smooth || (kind == VertexKind::kCrease && line)) {
          neighbors[static_cast<size_t>(v)].push_back(topology.edge_vertices(1 - side, e));
        }
      }
    }
    Umbrellas umbrellas;
    for (const std::vector<int>& of_vertex : neighbors) {
      umbrellas.neighbors_.insert(umbrellas.neighbors_.end(), of_vertex.begin(), of_vertex.end());
      umbrellas.begin_.push_back(static_cast<int>(umbrellas.neighbors_.size()));
    }
    return umbrellas;
  }

  Eigen::Matrix3Xd Apply(const Eigen::Matrix3Xd& values) const {
    Eigen::Matrix3Xd umbrella = Eigen::Matrix3Xd::Zero(3, values.cols());
    ForEach([&](int v, int w, double weight) { umbrella.col(v) += weight * values.col(w); });
    return umbrella;
  }
  Eigen::Matrix3Xd ApplyTransposed(const Eigen::Matrix3Xd& values) const {
    Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, values.cols());
    ForEach([&](int v, int w, double weight) { sums.col(w) += weight * values.col(v); });
    return sums;
  }

 private:
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    for (size_t v = 0; v + 1 < begin_.size(); ++v) {
      const int begin = begin_[v], end = begin_[v + 1];
      if (begin == end) continue;
      visit(static_cast<int>(v), static_cast<int>(v), -1);
      for (int i = begin; i < end; ++i) {
        visit(static_cast<int>(v), neighbors_[static_cast<size_t>(i)], 1.0 / (end - begin));
      }
    }
  }
  std::vector<int> begin_ = {0}, neighbors_;
};

// The limit masks of the given vertices, which reach themselves and new vertices alone.
class GivenLimits {
 public:
  GivenLimits(LimitStencils stencils, int given) : stencils_(std::move(stencils)), given_(given) {}

  // Sets each given vertex so that its limit is that column of `limits`.
  void Meet(const Eigen::Matrix3Xd& limits, Eigen::Matrix3Xd* points) const {
    for (int v = 0; v < given_; ++v) {
      Eigen::Vector3d rest = limits.col(v);
      double own = 1;
      ForEachWeight(v, [&](int w, double weight) {
        if (w == v) {
          own = weight;
        } else {
          rest -= weight * points->col(w);
        }
      });
      points->col(v) = rest / own;
    }
  }
  // The transpose of what Meet() with limits of zero does: given columns go over to the new ones.
  void PassOn(Eigen::Matrix3Xd* sums) const {
    for (int v = 0; v < given_; ++v) {
      double own = 1;
      ForEachWeight(v, [&](int w, double weight) { own = w == v ? weight : own; });
      ForEachWeight(v, [&](int w, double weight) {
        if (w != v) sums->col(w) -= weight / own * sums->col(v);
      });
      sums->col(v).setZero();
    }
  }

 private:
  template <typename Visit>
  void ForEachWeight(int v, const Visit& visit) const {
    const auto s = static_cast<size_t>(v);
    for (int i = stencils_.begin[s]; i < stencils_.begin[s + 1]; ++i) {
      visit(stencils_.control_vertices[static_cast<size_t>(i)],
            stencils_.position[static_cast<size_t>(i)]);
    }
  }
  LimitStencils stencils_;
  int given_;
};

}  // namespace

absl::Status InterpolationOptions::Validate() const {
  if (most_steps < 0 || most_steps > 1000) {
    return absl::InvalidArgumentError(
        absl::StrCat("most_steps = ", most_steps, ": must be in [0, 1000]"));
  }
  if (tolerance >= 0 && tolerance < 1) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("tolerance = ", tolerance, ": must be in [0, 1)"));
}

absl::StatusOr<InterpolatedMesh> InterpolateVertices(const ControlMesh& mesh,
                                                     const InterpolationOptions& options,
                                                     const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has coordinates that are not finite");
  }
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement given, RefineTopology(mesh, 0, context));
  InterpolatedMesh result{Refined(mesh, given)};
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(result.mesh, 0, context));
  RILIEVO_ASSIGN_OR_RETURN(const Umbrellas umbrellas,
                           Umbrellas::Of(result.mesh, refinement.levels.front()));
  RILIEVO_ASSIGN_OR_RETURN(LimitStencils stencils, BuildLimitStencils(refinement, 0, context));
  const auto count = static_cast<int>(mesh.vertices.cols());
  RILIEVO_ASSIGN_OR_RETURN(const LimitSurface limit,
                           EvaluateLimit(refinement, result.mesh.vertices, 0, context));
  const GivenLimits limits(std::move(stencils), count);

  // The difference from the subdivided mesh; at first a new vertex has the mean of its edge's ends.
  const Eigen::Matrix3Xd missing = mesh.vertices - limit.positions.leftCols(count);
  const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Zero(3, count);
  Eigen::Matrix3Xd difference(3, result.mesh.vertices.cols());
  const MeshTopology& edges = given.levels.front();
  for (int e = 0; e < edges.edge_count(); ++e) {
    difference.col(count + e) =
        (missing.col(edges.edge_vertices(0, e)) + missing.col(edges.edge_vertices(1, e))) / 2;
  }
  limits.Meet(missing, &difference);

  // Conjugate gradients on the squared umbrellas, in the new vertices.
  const auto gradient = [&](const Eigen::Matrix3Xd& at) {
    Eigen::Matrix3Xd sums = umbrellas.ApplyTransposed(umbrellas.Apply(at));
    limits.PassOn(&sums);
    return sums;
  };
  Eigen::Matrix3Xd residual = -gradient(difference), direction = residual;
  double square = residual.squaredNorm();
  const double enough = options.tolerance * options.tolerance * square;
  while (result.steps < options.most_steps && square > enough) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    // Given vertices of a direction move such that their limits stay.
    limits.Meet(none, &direction);
    const Eigen::Matrix3Xd bent = gradient(direction);
    const double curvature = direction.rightCols(edges.edge_count())
                                 .cwiseProduct(bent.rightCols(edges.edge_count()))
                                 .sum();
    if (!(curvature > 0)) break;
    difference += square / curvature * direction;
    residual -= square / curvature * bent;
    const double before = std::exchange(square, residual.squaredNorm());
    direction = residual + square / before * direction;
    ++result.steps;
  }
  result.mesh.vertices += difference;
  limits.Meet(mesh.vertices, &result.mesh.vertices);
  return result;
}

}  // namespace rilievo
