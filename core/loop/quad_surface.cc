#include "core/loop/quad_surface.h"

#include <Eigen/Geometry>
#include <span>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/limit_normal.h"

namespace rilievo {
namespace {

// Sides counted in triangles instead of quads.
void CountInTriangles(const QuadRing& ring, std::vector<SharpSector>& sectors) {
  const int edges = static_cast<int>(ring.triangle.size());
  const int triangles = static_cast<int>(ring.half_edges.size());
  for (SharpSector& sector : sectors) {
    const int last = sector.first + sector.face_count;
    const int begin = ring.triangle[sector.first];
    const int end = ring.triangle[last % edges] + (last < edges ? 0 : triangles);
    sector.first = begin;
    sector.face_count = end - begin;
  }
}

// Points of one level after the other.
absl::Status StepQuads(const LoopRefinement& refinement, int level, const Eigen::Matrix3Xd& values,
                       const RunContext& context, Eigen::Matrix3Xd* finer) {
  const MeshTopology& topology = refinement.levels[level];
  const QuadStep step(refinement, level);
  finer->resize(3, refinement.vertex_count(level + 1));
  const auto sum_into = [&](int vertex) {
    finer->col(vertex).setZero();
    return [&values, finer, vertex](int at, double weight) {
      finer->col(vertex) += weight * values.col(at);
    };
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(topology.vertex_count, kLightBlock, context, [&](int64_t begin, int64_t end) {
        QuadRing ring;
        for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v) {
          step.OldVertex(v, ring, sum_into(v));
        }
      }));
  return ParallelFor(topology.edge_count(), kLightBlock, context, [&](int64_t begin, int64_t end) {
    for (int e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
      step.NewVertex(e, sum_into(topology.vertex_count + e));
    }
  });
}

class QuadLimitEvaluation {
 public:
  QuadLimitEvaluation(const LoopRefinement& refinement, int level, const RunContext& context)
      : refinement_(refinement), level_(level), context_(context) {
    limit_.positions.resize(3, refinement.vertex_count(level));
    limit_.normals.resize(3, refinement.vertex_count(level));
  }

  absl::StatusOr<LimitSurface> Run(const Eigen::Matrix3Xd& control_points) {
    points_ = control_points;
    squared_noise_ = SquaredTangentNoise(control_points);
    RILIEVO_RETURN_IF_ERROR(LimitsOfControlVertices());
    for (int level = 0; level < level_; ++level) {
      Eigen::Matrix3Xd finer;
      RILIEVO_RETURN_IF_ERROR(StepQuads(refinement_, level, points_, context_, &finer));
      points_ = std::move(finer);
      RILIEVO_RETURN_IF_ERROR(LimitsOfNewVertices(level));
    }
    limit_.sector_normals.resize(3, static_cast<Eigen::Index>(sector_normals_.size()));
    for (size_t s = 0; s < sector_normals_.size(); ++s) {
      limit_.sector_normals.col(static_cast<Eigen::Index>(s)) = sector_normals_[s];
    }
    return std::move(limit_);
  }

 private:
  absl::Status LimitsOfControlVertices() {
    const MeshTopology& control = refinement_.levels.front();
    const QuadRings rings(control, refinement_.quads, 0);
    const auto put = [&](int v, QuadRing& ring, std::vector<Eigen::Vector3d>* sides) {
      rings.Of(v, ring);
      ring.neighbors.insert(ring.neighbors.end(), ring.opposite.begin(), ring.opposite.end());
      Put(v, ring.neighbors, QuadLimit(ring.sharp), sides);
    };
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(control.vertex_count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          QuadRing ring;
          for (int v = static_cast<int>(begin); v < static_cast<int>(end); ++v) {
            put(v, ring, nullptr);
          }
        }));
    QuadRing ring;
    for (const SharpControlVertex& sharp : refinement_.sharp.control) {
      if (sharp.limit.sectors.size() > 1) put(sharp.vertex, ring, &sector_normals_);
    }
    return absl::OkStatus();
  }

  absl::Status LimitsOfNewVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const QuadLevel& quads = refinement_.quads.levels[level];
    const auto put = [&](int edge, NewQuadLimits& limits, std::vector<Eigen::Vector3d>* sides) {
      const NewQuadRing ring = RingOfNewVertex(parent, quads, edge);
      Put(parent.vertex_count + edge, std::span(ring.neighbors).first(ring.size),
          limits.Of(ring.boundary, quads.sharpness[edge]), sides);
    };
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(parent.edge_count(), kLightBlock, context_, [&](int64_t begin, int64_t end) {
          NewQuadLimits limits;
          for (int e = static_cast<int>(begin); e < static_cast<int>(end); ++e) {
            put(e, limits, nullptr);
          }
        }));
    if (refinement_.sharp.empty()) return absl::OkStatus();
    NewQuadLimits limits;
    for (const SharpEdge& sharp : refinement_.sharp.levels[level].edges) {
      if (limits.Of(false, sharp.sharpness).sectors.size() > 1) {
        put(sharp.edge, limits, &sector_normals_);
      }
    }
    return absl::OkStatus();
  }

  // `sides`: where the normals of the mask's sides go, if anywhere.
  void Put(int vertex, std::span<const int> neighbors, const SharpLimitMask& mask,
           std::vector<Eigen::Vector3d>* sides) {
    const auto apply = [&](const std::vector<double>& weights) {
      Eigen::Vector3d sum = weights[0] * points_.col(vertex);
      for (size_t i = 0; i < neighbors.size(); ++i) {
        if (weights[1 + i] != 0.0) sum += weights[1 + i] * points_.col(neighbors[i]);
      }
      return sum;
    };
    limit_.positions.col(vertex) = apply(mask.position);
    // As many corners as edges, or one less.
    const auto edges = static_cast<int>((neighbors.size() + 1) / 2);
    const auto corners = static_cast<int>(neighbors.size()) - edges;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const SharpSector& sector : mask.sectors) {
      Eigen::Vector3d normal;
      if (!NormalFromTangents(apply(sector.tangent_u), apply(sector.tangent_v), squared_noise_,
                              normal)) {
        normal = FanNormal(points_.col(vertex), 2 * sector.face_count + 1, false,
                           [&](int i) -> Eigen::Vector3d {
                             const int at = sector.first + i / 2;
                             return points_.col(i % 2 == 0 ? neighbors[at % edges]
                                                           : neighbors[edges + at % corners]);
                           });
      }
      sum += normal;
      if (sides != nullptr) sides->push_back(normal);
    }
    const double length = sum.norm();
    limit_.normals.col(vertex) =
        length > kMinTangentSine ? Eigen::Vector3d(sum / length) : Eigen::Vector3d::UnitZ();
  }

  const LoopRefinement& refinement_;
  const int level_;
  const RunContext& context_;
  double squared_noise_ = 0.0;
  Eigen::Matrix3Xd points_;  // of the level reached so far
  std::vector<Eigen::Vector3d> sector_normals_;
  LimitSurface limit_;
};

}  // namespace

SharpRefinement SharpPartsOf(const std::vector<MeshTopology>& levels, const QuadRefinement& quads) {
  SharpRefinement sharp;
  std::vector<SharpLevel> sharp_levels;
  for (const QuadLevel& level : quads.levels) {
    std::vector<SharpEdge>& edges = sharp_levels.emplace_back().edges;
    for (int e = 0; e < static_cast<int>(level.sharpness.size()); ++e) {
      if (level.sharpness[e] > 0.0f) edges.push_back({e, level.sharpness[e]});
    }
  }
  const MeshTopology& control = levels.front();
  std::vector<uint8_t> is_sharp(control.vertex_count, 0);
  for (const SharpEdge& edge : sharp_levels.front().edges) {
    for (int end = 0; end < 2; ++end) is_sharp[control.edge_vertices(end, edge.edge)] = 1;
  }
  for (const int corner : quads.corners) is_sharp[corner] = 1;
  const QuadRings rings(control, quads, 0);
  QuadRing ring;
  for (int v = 0; v < control.vertex_count; ++v) {
    if (is_sharp[v] == 0) continue;
    rings.Of(v, ring);
    SharpControlVertex& vertex = sharp.control.emplace_back();
    vertex.vertex = v;
    vertex.neighbors = ring.neighbors;
    vertex.neighbors.insert(vertex.neighbors.end(), ring.opposite.begin(), ring.opposite.end());
    vertex.half_edges = ring.half_edges;
    vertex.limit = QuadLimit(ring.sharp);
    CountInTriangles(ring, vertex.limit.sectors);
  }
  if (!sharp.control.empty()) sharp.levels = std::move(sharp_levels);
  return sharp;
}

Eigen::Matrix3Xd SubdivideQuadsOnce(const LoopRefinement& refinement, int level,
                                    const Eigen::Matrix3Xd& values) {
  RunContext alone;
  alone.threads = 1;
  Eigen::Matrix3Xd finer;
  // Nothing stops it.
  StepQuads(refinement, level, values, alone, &finer).IgnoreError();
  return finer;
}

absl::StatusOr<LimitSurface> EvaluateQuadLimit(const LoopRefinement& refinement,
                                               const Eigen::Matrix3Xd& control_points, int level,
                                               const RunContext& context) {
  return QuadLimitEvaluation(refinement, level, context).Run(control_points);
}

}  // namespace rilievo
