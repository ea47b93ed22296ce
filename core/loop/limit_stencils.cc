#include "core/loop/limit_stencils.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/edge_star.h"
#include "core/loop/loop_masks.h"
#include "core/loop/quad_surface.h"
#include "core/loop/sparse_rows.h"
#include "core/loop/subdivision_rules.h"

namespace rilievo {
namespace {

// The same recurrence as in limit_surface.cc, on rows instead of points. `vertices_` rows hold the
// weights of a vertex and of its ring sum at the level reached so far; what only the ring sum
// reaches has a zero for the vertex.
class StencilPropagation {
 public:
  StencilPropagation(const LoopRefinement& refinement, int level, const RunContext& context)
      : refinement_(refinement), level_(level), context_(context) {}

  absl::StatusOr<LimitStencils> Run() {
    RILIEVO_RETURN_IF_ERROR(StartWithControlVertices());
    for (int level = 0; level < level_; ++level) {
      RILIEVO_RETURN_IF_ERROR(AddEdgeVertices(level));
      RILIEVO_RETURN_IF_ERROR(MoveOldVertices(level));
      RILIEVO_RETURN_IF_ERROR(LimitsOfEdgeVertices(level));
    }
    return std::move(limits_);
  }

 private:
  enum Channel { kSelf, kRing, kTangentU, kTangentV };
  struct Block {
    SparseRows<2> vertices;  // empty when no later level needs them
    LimitStencils limits;
  };
  int ControlVertexCount() const { return refinement_.levels.front().vertex_count; }

  // Calls make(accumulator, begin, end, block) for blocks of [0, count); results in order of
  // blocks.
  template <int Width, typename Result, typename Make>
  absl::StatusOr<std::vector<Result>> InBlocks(int count, const Make& make) const {
    std::vector<Result> results((count + kLightBlock - 1) / kLightBlock);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          RowAccumulator<Width> accumulator(ControlVertexCount());
          make(accumulator, static_cast<int>(begin), static_cast<int>(end),
               results[begin / kLightBlock]);
        }));
    return results;
  }

  absl::Status StartWithControlVertices() {
    const MeshTopology& control = refinement_.levels.front();
    const VertexRings rings = BuildVertexRings(control);
    const auto make = [&](RowAccumulator<4>& row, int begin, int end, Block& block) {
      Reserve(end - begin, 0, block);
      const std::vector<SharpControlVertex>& sharp = refinement_.sharp.control;
      auto next_sharp = std::lower_bound(
          sharp.begin(), sharp.end(), begin,
          [](const SharpControlVertex& vertex, int first) { return vertex.vertex < first; });
      for (int v = begin; v < end; ++v) {
        if (next_sharp != sharp.end() && next_sharp->vertex == v) {
          AddSharpVertex(row, v, next_sharp->neighbors, next_sharp->limit, 0, block);
          ++next_sharp;
          continue;
        }
        const int valence = control.valence[v];
        const bool boundary = control.boundary_vertex[v];
        const LoopLimitMask mask =
            boundary ? BoundaryLimitMask(valence) : InteriorLimitMask(valence);
        const int* ring = rings.neighbors.data() + rings.neighbor_begin[v];
        row.Add(v, 1.0, {1.0, 0.0, mask.tangent_u_self, mask.tangent_v_self});
        for (int i = 0; i < valence; ++i) {
          const double in_sum = mask.position[i] != 0.0 ? 1.0 : 0.0;
          row.Add(ring[i], 1.0, {0.0, in_sum, mask.tangent_u[i], mask.tangent_v[i]});
        }
        Flush(row, mask.position_self, mask.position.front(), 0, block);
      }
    };
    return Append(InBlocks<4, Block>(control.vertex_count, make));
  }

  absl::Status AddEdgeVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const auto make = [&](RowAccumulator<1>& row, int begin, int end, SparseRows<1>& rows) {
      rows.Reserve(end - begin);
      const std::span<const SharpEdge> sharp = SharpEdges(level);
      auto next_sharp = FirstFrom(sharp, begin);
      for (int e = begin; e < end; ++e) {
        const EdgeStar star = StarOfEdge(parent, e);
        SharpEdgeWeights weights = {0.375, 0.125};
        if (star.boundary()) weights = {0.5, 0.0};
        if (next_sharp != sharp.end() && next_sharp->edge == e) {
          weights = WeightsOfSharpEdge(*next_sharp++);
        }
        row.AddRow(vertices_, star.from, {weights.end});
        row.AddRow(vertices_, star.to, {weights.end});
        if (weights.opposite != 0.0) {
          row.AddRow(vertices_, star.opposite_first, {weights.opposite});
          row.AddRow(vertices_, star.opposite_second, {weights.opposite});
        }
        row.Flush([&](int control_vertex, const std::array<double, 1>& weight) {
          rows.Push(control_vertex, weight);
        });
        rows.EndRow();
      }
    };
    RILIEVO_ASSIGN_OR_RETURN(std::vector<SparseRows<1>> blocks,
                             (InBlocks<1, SparseRows<1>>(parent.edge_count(), make)));
    edge_vertices_ = SparseRows<1>();
    for (SparseRows<1>& rows : blocks) {
      edge_vertices_.Append(rows);
      rows = SparseRows<1>();
    }
    return absl::OkStatus();
  }

  absl::Status MoveOldVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const SparseRows<1> sharp_rows = MovedSharpVertices(level);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(parent.vertex_count, kLightBlock, context_, [&](int64_t begin, int64_t end) {
          for (int64_t v = begin; v < end; ++v) {
            const VertexRule rule = RuleOfVertex(parent, static_cast<int>(v));
            for (int i = vertices_.begin[v]; i < vertices_.begin[v + 1]; ++i) {
              const auto [self, ring] = vertices_.weights[i];
              vertices_.weights[i] = {rule.self * self + rule.ring * ring,
                                      rule.sum_self * self + rule.sum_ring * ring};
            }
          }
        }));
    for (int i = 0; i + 1 < static_cast<int>(sharp_rows.begin.size()); ++i) {
      OverwriteVertex(refinement_.sharp.levels[level].vertices[i], sharp_rows, i);
    }
    return absl::OkStatus();
  }

  SparseRows<1> MovedSharpVertices(int level) const {
    SparseRows<1> rows;
    if (refinement_.sharp.empty()) return rows;
    const SharpLevel& sharp = refinement_.sharp.levels[level];
    RowAccumulator<1> row(ControlVertexCount());
    for (size_t i = 0; i < sharp.vertices.size(); ++i) {
      for (int n = sharp.begin[i]; n < sharp.begin[i + 1]; ++n) {
        row.AddRow(vertices_, sharp.neighbors[n], {sharp.weights[n]});
      }
      row.Flush([&](int control_vertex, const std::array<double, 1>& weight) {
        rows.Push(control_vertex, weight);
      });
      rows.EndRow();
    }
    return rows;
  }

  // The row of a vertex reaches as far as its ring did at the level that first held it, and where
  // the vertex goes depends on that ring alone: the new row fits into the old one.
  void OverwriteVertex(int vertex, const SparseRows<1>& rows, int row) {
    int from = rows.begin[row];
    for (int i = vertices_.begin[vertex]; i < vertices_.begin[vertex + 1]; ++i) {
      const bool reached = from < rows.begin[row + 1] &&
                           rows.control_vertices[from] == vertices_.control_vertices[i];
      vertices_.weights[i] = {reached ? rows.weights[from++][0] : 0.0, 0.0};
    }
  }

  absl::Status LimitsOfEdgeVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const LoopLimitMask regular = InteriorLimitMask(6), border = BoundaryLimitMask(4);
    const auto make = [&](RowAccumulator<4>& row, int begin, int end, Block& block) {
      Reserve(end - begin, level + 1, block);
      const std::span<const SharpEdge> sharp = SharpEdges(level);
      auto next_sharp = FirstFrom(sharp, begin);
      SharpEdgeLimits limits;
      for (int e = begin; e < end; ++e) {
        const EdgeStar star = StarOfEdge(parent, e);
        const std::array<int, 6> ring = RingOfEdgeVertex(star, parent.vertex_count);
        if (next_sharp != sharp.end() && next_sharp->edge == e) {
          const SharpEdge& edge = *next_sharp++;
          if (StartsSharp(edge)) {
            AddSharpVertex(row, parent.vertex_count + e, ring, limits.Of(edge), level + 1, block);
            continue;
          }
        }
        const LoopLimitMask& mask = star.boundary() ? border : regular;
        row.AddRow(edge_vertices_, e, {1.0, 0.0, mask.tangent_u_self, mask.tangent_v_self});
        for (size_t i = 0; i < mask.position.size(); ++i) {
          const std::array<double, 4> factors = {0.0, mask.position[i] != 0.0 ? 1.0 : 0.0,
                                                 mask.tangent_u[i], mask.tangent_v[i]};
          AddRowOf(ring[i], parent.vertex_count, factors, row);
        }
        Flush(row, mask.position_self, mask.position.front(), level + 1, block);
      }
    };
    return Append(InBlocks<4, Block>(parent.edge_count(), make));
  }

  // The row of a vertex among the first `old_count`, or of one on an edge.
  void AddRowOf(int vertex, int old_count, const std::array<double, 4>& factors,
                RowAccumulator<4>& row) const {
    if (vertex < old_count) {
      row.AddRow(vertices_, vertex, factors);
    } else {
      row.AddRow(edge_vertices_, vertex - old_count, factors);
    }
  }

  std::span<const SharpEdge> SharpEdges(int level) const {
    if (refinement_.sharp.empty()) return {};
    return refinement_.sharp.levels[level].edges;
  }

  static std::span<const SharpEdge>::iterator FirstFrom(std::span<const SharpEdge> sharp,
                                                        int edge) {
    return std::lower_bound(sharp.begin(), sharp.end(), edge,
                            [](const SharpEdge& x, int first) { return x.edge < first; });
  }

  // The stencil and the sectors of a sharp vertex born at `level`. No later level needs its ring
  // sum, but its row must reach the whole ring (OverwriteVertex).
  template <typename Ring>
  void AddSharpVertex(RowAccumulator<4>& row, int vertex, const Ring& ring,
                      const SharpLimitMask& mask, int level, Block& block) const {
    const auto add = [&](const SharpSector& sector) {
      for (size_t i = 0; i < mask.position.size(); ++i) {
        const int at = i == 0 ? vertex : ring[i - 1];
        const std::array<double, 4> factors = {i == 0 ? 1.0 : 0.0, mask.position[i],
                                               sector.tangent_u[i], sector.tangent_v[i]};
        if (level == 0) {
          row.Add(at, 1.0, factors);
        } else {
          AddRowOf(at, refinement_.levels[level - 1].vertex_count, factors, row);
        }
      }
    };
    for (const SharpSector& sector : mask.sectors) {
      if (mask.sectors.size() == 1) break;
      add(sector);
      FlushSector(row, vertex, block.limits.sectors);
    }
    add(mask.whole);
    Flush(row, 0.0, 1.0, level, block);  // the second channel is the limit position
  }

  static void FlushSector(RowAccumulator<4>& row, int vertex, SectorStencils& sectors) {
    row.Flush([&](int control_vertex, const std::array<double, 4>& sums) {
      if (sums[kTangentU] == 0.0 && sums[kTangentV] == 0.0) return;
      sectors.control_vertices.push_back(control_vertex);
      sectors.tangent_u.push_back(sums[kTangentU]);
      sectors.tangent_v.push_back(sums[kTangentV]);
    });
    sectors.vertices.push_back(vertex);
    sectors.begin.push_back(static_cast<int>(sectors.control_vertices.size()));
  }

  // Room for `rows` rows of vertices born at `level`.
  void Reserve(int rows, int level, Block& block) const {
    if (level < level_) block.vertices.Reserve(rows);
    block.limits.begin.reserve(rows + 1);
    block.limits.control_vertices.reserve(rows * kEntriesPerRow);
    block.limits.position.reserve(rows * kEntriesPerRow);
    block.limits.tangent_u.reserve(rows * kEntriesPerRow);
    block.limits.tangent_v.reserve(rows * kEntriesPerRow);
  }

  // Ends a row of the four channels, of a vertex born at `level`.
  void Flush(RowAccumulator<4>& row, double self_weight, double ring_weight, int level,
             Block& block) const {
    const bool needed_later = level < level_;
    LimitStencils& limits = block.limits;
    row.Flush([&](int control_vertex, const std::array<double, 4>& sums) {
      if (needed_later) block.vertices.Push(control_vertex, {sums[kSelf], sums[kRing]});
      limits.control_vertices.push_back(control_vertex);
      limits.position.push_back(self_weight * sums[kSelf] + ring_weight * sums[kRing]);
      limits.tangent_u.push_back(sums[kTangentU]);
      limits.tangent_v.push_back(sums[kTangentV]);
    });
    if (needed_later) block.vertices.EndRow();
    limits.begin.push_back(static_cast<int>(limits.control_vertices.size()));
  }

  absl::Status Append(absl::StatusOr<std::vector<Block>> blocks) {
    if (!blocks.ok()) return blocks.status();
    std::vector<LimitStencils> limits;
    for (Block& block : *blocks) {
      vertices_.Append(block.vertices);
      limits.push_back(std::move(block.limits));
      block = Block();
    }
    return AppendStencils(std::move(limits), &limits_);
  }

  const LoopRefinement& refinement_;
  const int level_;
  const RunContext& context_;
  SparseRows<2> vertices_;
  SparseRows<1> edge_vertices_;  // of the level being added
  LimitStencils limits_;
};

// For each sample of a face, where the face's finest faces name it: 3 t + k, corner k of its
// finest face t. The refinement splits all faces alike, so this table serves all of them.
std::vector<int> CornersOfSamples(int level) {
  const int side = 1 << level;
  // Twice barycentric grid coordinates of a triangle's corners along sides 0-1 and 0-2.
  using Triangle = std::array<std::array<int, 2>, 3>;
  std::vector<Triangle> triangles = {{{{0, 0}, {side, 0}, {0, side}}}};
  for (int l = 0; l < level; ++l) {
    std::vector<Triangle> fine;
    for (const Triangle& t : triangles) {
      Triangle m;
      for (int k = 0; k < 3; ++k) {
        for (int i = 0; i < 2; ++i) m[k][i] = (t[k][i] + t[(k + 1) % 3][i]) / 2;
      }
      fine.insert(fine.end(),
                  {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[1], m[2], m[0]}});
    }
    triangles = std::move(fine);
  }
  std::vector<int> corners((side + 1) * (side + 2) / 2, -1);
  for (size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [i, j] = triangles[t][k];
      corners[j * (2 * side + 3 - j) / 2 + i] = static_cast<int>(3 * t) + k;
    }
  }
  return corners;
}

}  // namespace

absl::StatusOr<LimitStencils> BuildLimitStencils(const LoopRefinement& refinement, int level,
                                                 const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckLimitLevel(refinement, level));
  if (!refinement.quads.empty()) return BuildQuadStencils(refinement, level, context);
  return StencilPropagation(refinement, level, context).Run();
}

void SetSharpNormals(const LimitStencils& stencils, const Eigen::Matrix3Xd& control_points,
                     Eigen::Matrix3Xd& normals) {
  const SectorStencils& sectors = stencils.sectors;
  for (int s = 0; s < sectors.size();) {
    const int vertex = sectors.vertices[s];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (; s < sectors.size() && sectors.vertices[s] == vertex; ++s) {
      Eigen::Vector3d tangent_u = Eigen::Vector3d::Zero(), tangent_v = Eigen::Vector3d::Zero();
      for (int i = sectors.begin[s]; i < sectors.begin[s + 1]; ++i) {
        const Eigen::Vector3d point = control_points.col(sectors.control_vertices[i]);
        tangent_u += sectors.tangent_u[i] * point;
        tangent_v += sectors.tangent_v[i] * point;
      }
      sum += tangent_u.cross(tangent_v).normalized();
    }
    if (sum.norm() > 0.0) normals.col(vertex) = sum.normalized();
  }
}

FaceSamples SamplesOfControlFaces(const LoopRefinement& refinement, int level) {
  const std::vector<int> corners = CornersOfSamples(level);
  const Eigen::Matrix3Xi& faces = refinement.levels[level].faces;
  const int64_t entries_per_face = int64_t{3} << (2 * level);
  FaceSamples samples;
  samples.per_face = static_cast<int>(corners.size());
  samples.vertices.reserve(corners.size() * refinement.levels.front().face_count());
  for (int64_t f = 0; f < refinement.levels.front().face_count(); ++f) {
    const int* const fine_faces = faces.data() + f * entries_per_face;
    for (int corner : corners) samples.vertices.push_back(fine_faces[corner]);
  }
  return samples;
}

}  // namespace rilievo
