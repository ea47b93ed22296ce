#include <Eigen/Geometry>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/edge_star.h"
#include "core/loop/limit_normal.h"
#include "core/loop/loop_masks.h"
#include "core/loop/quad_surface.h"
#include "core/loop/refinement.h"
#include "core/loop/subdivision_rules.h"

namespace rilievo {
namespace {

// Carries positions and ring sums from level to level. Every vertex' limit is taken at the level
// that first holds it, from the topology of the level before: the finest level's own topology is
// not looked at.
class LimitEvaluation {
 public:
  LimitEvaluation(const LoopRefinement& refinement, int level, const RunContext& context)
      : refinement_(refinement), level_(level), context_(context) {
    const int count = refinement.vertex_count(level);
    positions_.resize(3, count);
    ring_sums_.resize(3, level > 0 ? refinement.levels[level - 1].vertex_count : 0);
    limit_.positions.resize(3, count);
    limit_.normals.resize(3, count);
  }

  absl::StatusOr<LimitSurface> Run(const Eigen::Matrix3Xd& control_points) {
    RILIEVO_RETURN_IF_ERROR(StartWith(control_points));
    for (int level = 0; level < level_; ++level) {
      RILIEVO_RETURN_IF_ERROR(AddEdgeVertices(level));
      RILIEVO_RETURN_IF_ERROR(MoveOldVertices(level));
      RILIEVO_RETURN_IF_ERROR(LimitsOfEdgeVertices(level));
    }
    FinishSectorNormals();
    return std::move(limit_);
  }

 private:
  // Sharp edges and vertices are few: each step below first treats all alike, and then sets right
  // the sharp ones, so that a smooth surface costs nothing more.
  absl::Status StartWith(const Eigen::Matrix3Xd& control_points) {
    const MeshTopology& control = refinement_.levels.front();
    const VertexRings rings = BuildVertexRings(control);
    positions_.leftCols(control.vertex_count) = control_points;
    squared_noise_ = SquaredTangentNoise(control_points);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(control.vertex_count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          for (int64_t v = begin; v < end; ++v) {
            LimitOfControlVertex(control, static_cast<int>(v),
                                 rings.neighbors.data() + rings.neighbor_begin[v]);
          }
        }));
    for (const SharpControlVertex& sharp : refinement_.sharp.control) {
      LimitOfSharpVertex(sharp.vertex, sharp.neighbors.data(), sharp.limit);
    }
    return absl::OkStatus();
  }

  void LimitOfControlVertex(const MeshTopology& control, int v, const int* ring) {
    const int valence = control.valence[v];
    const bool boundary = control.boundary_vertex[v];
    const LoopLimitMask mask = boundary ? BoundaryLimitMask(valence) : InteriorLimitMask(valence);
    const Eigen::Vector3d self = positions_.col(v);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), position = mask.position_self * self;
    Eigen::Vector3d tangent_u = mask.tangent_u_self * self, tangent_v = mask.tangent_v_self * self;
    for (int i = 0; i < valence; ++i) {
      const Eigen::Vector3d neighbor = positions_.col(ring[i]);
      if (!boundary || i == 0 || i + 1 == valence) sum += neighbor;
      position += mask.position[i] * neighbor;
      tangent_u += mask.tangent_u[i] * neighbor;
      tangent_v += mask.tangent_v[i] * neighbor;
    }
    if (level_ > 0) ring_sums_.col(v) = sum;
    Eigen::Vector3d normal;
    if (!NormalFromTangents(tangent_u, tangent_v, squared_noise_, normal)) {
      normal = FanNormal(self, valence, !boundary,
                         [&](int i) -> Eigen::Vector3d { return positions_.col(ring[i]); });
    }
    limit_.positions.col(v) = position;
    limit_.normals.col(v) = normal;
  }

  absl::Status AddEdgeVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(parent.edge_count(), kLightBlock, context_, [&](int64_t begin, int64_t end) {
          for (int64_t e = begin; e < end; ++e) {
            positions_.col(parent.vertex_count + e) =
                EdgePoint(StarOfEdge(parent, static_cast<int>(e)), positions_);
          }
        }));
    if (refinement_.sharp.empty()) return absl::OkStatus();
    for (const SharpEdge& sharp : refinement_.sharp.levels[level].edges) {
      positions_.col(parent.vertex_count + sharp.edge) = SharpEdgePoint(parent, sharp, positions_);
    }
    return absl::OkStatus();
  }

  absl::Status MoveOldVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const Eigen::Matrix3Xd sharp_points = MovedSharpVertices(level);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(parent.vertex_count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          for (int64_t v = begin; v < end; ++v) {
            const VertexRule rule = RuleOfVertex(parent, static_cast<int>(v));
            const Eigen::Vector3d position = positions_.col(v), sum = ring_sums_.col(v);
            positions_.col(v) = rule.self * position + rule.ring * sum;
            ring_sums_.col(v) = rule.sum_self * position + rule.sum_ring * sum;
          }
        }));
    for (Eigen::Index i = 0; i < sharp_points.cols(); ++i) {
      positions_.col(refinement_.sharp.levels[level].vertices[i]) = sharp_points.col(i);
    }
    return absl::OkStatus();
  }

  Eigen::Matrix3Xd MovedSharpVertices(int level) const {
    if (refinement_.sharp.empty()) return {};
    const SharpLevel& sharp = refinement_.sharp.levels[level];
    Eigen::Matrix3Xd points(3, sharp.vertices.size());
    for (size_t i = 0; i < sharp.vertices.size(); ++i) {
      points.col(i) = SharpVertexPoint(sharp, i, positions_);
    }
    return points;
  }

  absl::Status LimitsOfEdgeVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(parent.edge_count(), kLightBlock, context_, [&](int64_t begin, int64_t end) {
          for (int64_t e = begin; e < end; ++e) {
            const EdgeStar star = StarOfEdge(parent, static_cast<int>(e));
            const int vertex = parent.vertex_count + static_cast<int>(e);
            const std::array<int, 6> ring = RingOfEdgeVertex(star, parent.vertex_count);
            if (star.boundary()) {
              LimitOfBoundaryVertex(vertex, ring);
            } else {
              LimitOfRegularVertex(vertex, ring);
            }
          }
        }));
    if (refinement_.sharp.empty()) return absl::OkStatus();
    SharpEdgeLimits limits;
    for (const SharpEdge& sharp : refinement_.sharp.levels[level].edges) {
      if (!StartsSharp(sharp)) continue;
      const std::array<int, 6> ring =
          RingOfEdgeVertex(StarOfEdge(parent, sharp.edge), parent.vertex_count);
      LimitOfSharpVertex(parent.vertex_count + sharp.edge, ring.data(), limits.Of(sharp));
    }
    return absl::OkStatus();
  }

  void LimitOfRegularVertex(int vertex, const std::array<int, 6>& ring) {
    const Eigen::Vector3d self = positions_.col(vertex);
    const Eigen::Vector3d p0 = positions_.col(ring[0]), p1 = positions_.col(ring[1]),
                          p2 = positions_.col(ring[2]), p3 = positions_.col(ring[3]),
                          p4 = positions_.col(ring[4]), p5 = positions_.col(ring[5]);
    const Eigen::Vector3d sum = ((p0 + p3) + (p1 + p4)) + (p2 + p5);
    const Eigen::Vector3d d0 = p0 - p3, d1 = p1 - p4, d2 = p2 - p5;
    // cos and sin of 60 degrees, less the common factor sqrt(3)/2 of the second.
    const Eigen::Vector3d tangent_u = d0 + 0.5 * (d1 - d2), tangent_v = d1 + d2;
    Store(vertex, 0.5 * self + (1.0 / 12.0) * sum, tangent_u, tangent_v, sum, ring, 6);
  }

  // The mask of BoundaryLimitMask(4), scaled.
  void LimitOfBoundaryVertex(int vertex, const std::array<int, 6>& ring) {
    const Eigen::Vector3d self = positions_.col(vertex);
    const Eigen::Vector3d p0 = positions_.col(ring[0]), p1 = positions_.col(ring[1]),
                          p2 = positions_.col(ring[2]), p3 = positions_.col(ring[3]);
    const Eigen::Vector3d sum = p0 + p3;
    Store(vertex, (2.0 / 3.0) * self + (1.0 / 6.0) * sum, p0 - p3, (p1 + p2) - self - 0.5 * sum,
          sum, ring, 4);
  }

  // The ring sum of a sharp vertex serves no one.
  void LimitOfSharpVertex(int vertex, const int* ring, const SharpLimitMask& mask) {
    const int valence = static_cast<int>(mask.position.size()) - 1;
    const auto apply = [&](const std::vector<double>& weights) {
      Eigen::Vector3d sum = weights[0] * positions_.col(vertex);
      for (int i = 0; i < valence; ++i) {
        if (weights[1 + i] != 0.0) sum += weights[1 + i] * positions_.col(ring[i]);
      }
      return sum;
    };
    limit_.positions.col(vertex) = apply(mask.position);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SharpSector& sector : mask.sectors) {
      Eigen::Vector3d normal;
      if (!NormalFromTangents(apply(sector.tangent_u), apply(sector.tangent_v), squared_noise_,
                              normal)) {
        // A closed ring's last face lies between its last and its first neighbour.
        normal = FanNormal(positions_.col(vertex), sector.face_count + 1, false,
                           [&](int i) -> Eigen::Vector3d {
                             return positions_.col(ring[(sector.first + i) % valence]);
                           });
      }
      sum += normal;
      if (mask.sectors.size() > 1) sector_normals_.push_back(normal);
    }
    const double length = sum.norm();
    limit_.normals.col(vertex) =
        length > kMinTangentSine ? Eigen::Vector3d(sum / length) : Eigen::Vector3d::UnitZ();
  }

  void FinishSectorNormals() {
    limit_.sector_normals.resize(3, static_cast<Eigen::Index>(sector_normals_.size()));
    for (size_t s = 0; s < sector_normals_.size(); ++s) {
      limit_.sector_normals.col(static_cast<Eigen::Index>(s)) = sector_normals_[s];
    }
  }

  void Store(int vertex, const Eigen::Vector3d& position, const Eigen::Vector3d& tangent_u,
             const Eigen::Vector3d& tangent_v, const Eigen::Vector3d& sum,
             const std::array<int, 6>& ring, int valence) {
    if (vertex < ring_sums_.cols()) ring_sums_.col(vertex) = sum;
    Eigen::Vector3d normal;
    if (!NormalFromTangents(tangent_u, tangent_v, squared_noise_, normal)) {
      normal = FanNormal(positions_.col(vertex), valence, valence == 6,
                         [&](int i) -> Eigen::Vector3d { return positions_.col(ring[i]); });
    }
    limit_.positions.col(vertex) = position;
    limit_.normals.col(vertex) = normal;
  }

  const LoopRefinement& refinement_;
  const int level_;
  const RunContext& context_;
  double squared_noise_ = 0.0;
  Eigen::Matrix3Xd positions_;  // at the level reached so far; room for the last
  Eigen::Matrix3Xd ring_sums_;  // of all vertices but those the last level adds
  std::vector<Eigen::Vector3d> sector_normals_;
  LimitSurface limit_;
};

}  // namespace

absl::Status CheckLimitLevel(const LoopRefinement& refinement, int level) {
  const int last = refinement.max_level() + 1;
  if (level < 0 || level > last) {
    return absl::InvalidArgumentError(
        absl::StrCat("level is ", level, ", the refinement serves limits at level 0 to ", last));
  }
  if (level == last && 4 * int64_t{refinement.levels.back().face_count()} > kMaxLoopFaces) {
    return absl::ResourceExhaustedError(
        absl::StrCat("level ", level, " would have more than ", kMaxLoopFaces, " faces"));
  }
  return absl::OkStatus();
}

absl::StatusOr<LimitSurface> EvaluateLimit(const LoopRefinement& refinement,
                                           const Eigen::Matrix3Xd& control_points, int level,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckLimitLevel(refinement, level));
  if (control_points.cols() != refinement.levels.front().vertex_count) {
    return absl::InvalidArgumentError(absl::StrCat(
        "control_points has ", control_points.cols(), " columns, the control mesh has ",
        refinement.levels.front().vertex_count, " vertices"));
  }
  if (!refinement.quads.empty())
    return EvaluateQuadLimit(refinement, control_points, level, context);
  return LimitEvaluation(refinement, level, context).Run(control_points);
}

}  // namespace rilievo
