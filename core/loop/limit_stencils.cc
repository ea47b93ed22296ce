#include "core/loop/limit_stencils.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/edge_star.h"
#include "core/loop/loop_masks.h"
#include "core/loop/subdivision_rules.h"

namespace rilievo {
namespace {

constexpr int64_t kVerticesPerBlock = 2048;

// Entries of most rows, for reserving: a regular patch has 12 control vertices.
constexpr int kEntriesPerRow = 12;

template <typename T>
void AppendAll(const std::vector<T>& more, std::vector<T>& all) {
  all.insert(all.end(), more.begin(), more.end());
}

void AppendBegins(const std::vector<int>& more, std::vector<int>& begin) {
  const int offset = begin.back();
  for (size_t r = 1; r < more.size(); ++r) begin.push_back(offset + more[r]);
}

// Sparse rows of `Width` weights an entry; column = entry, ascending control vertices within a row.
template <int Width>
struct SparseRows {
  std::vector<int> begin = {0};
  std::vector<int> control_vertices;
  std::vector<std::array<double, Width>> weights;

  void Reserve(int rows) {
    begin.reserve(rows + 1);
    control_vertices.reserve(rows * kEntriesPerRow);
    weights.reserve(rows * kEntriesPerRow);
  }
  void Push(int control_vertex, const std::array<double, Width>& weight) {
    control_vertices.push_back(control_vertex);
    weights.push_back(weight);
  }
  void EndRow() { begin.push_back(static_cast<int>(control_vertices.size())); }
  void Append(const SparseRows& rows) {
    AppendBegins(rows.begin, begin);
    AppendAll(rows.control_vertices, control_vertices);
    AppendAll(rows.weights, weights);
  }
};

// Sums of sparse rows: a dense row of control vertices that remembers which of them it holds.
template <int Width>
class RowAccumulator {
 public:
  explicit RowAccumulator(int control_vertex_count)
      : held_(control_vertex_count, 0), weights_(control_vertex_count) {}

  void Add(int control_vertex, double weight, const std::array<double, Width>& factors) {
    std::array<double, Width>& sum = weights_[control_vertex];
    if (!held_[control_vertex]) {
      held_[control_vertex] = 1;
      touched_.push_back(control_vertex);
      sum.fill(0.0);
    }
    for (int i = 0; i < Width; ++i) sum[i] += weight * factors[i];
  }

  template <int RowWidth>
  void AddRow(const SparseRows<RowWidth>& rows, int row, const std::array<double, Width>& factors) {
    for (int i = rows.begin[row]; i < rows.begin[row + 1]; ++i) {
      if (rows.weights[i][0] == 0.0) continue;  // there for the ring sum only
      Add(rows.control_vertices[i], rows.weights[i][0], factors);
    }
  }

  // Calls emit(control_vertex, sums) in ascending order, and empties the row.
  template <typename Emit>
  void Flush(const Emit& emit) {
    std::sort(touched_.begin(), touched_.end());
    for (int control_vertex : touched_) {
      held_[control_vertex] = 0;
      emit(control_vertex, weights_[control_vertex]);
    }
    touched_.clear();
  }

 private:
  std::vector<uint8_t> held_;
  std::vector<std::array<double, Width>> weights_;
  std::vector<int> touched_;
};

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
    std::vector<Result> results((count + kVerticesPerBlock - 1) / kVerticesPerBlock);
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(count, kVerticesPerBlock, context_, [&](int64_t begin, int64_t end) {
          RowAccumulator<Width> accumulator(ControlVertexCount());
          make(accumulator, static_cast<int>(begin), static_cast<int>(end),
               results[begin / kVerticesPerBlock]);
        }));
    return results;
  }

  absl::Status StartWithControlVertices() {
    const MeshTopology& control = refinement_.levels.front();
    const VertexRings rings = BuildVertexRings(control);
    const auto make = [&](RowAccumulator<4>& row, int begin, int end, Block& block) {
      Reserve(end - begin, 0, block);
      for (int v = begin; v < end; ++v) {
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
      for (int e = begin; e < end; ++e) {
        const EdgeStar star = StarOfEdge(parent, e);
        const double end_weight = star.boundary() ? 0.5 : 0.375;
        row.AddRow(vertices_, star.from, {end_weight});
        row.AddRow(vertices_, star.to, {end_weight});
        if (!star.boundary()) {
          row.AddRow(vertices_, star.opposite_first, {0.125});
          row.AddRow(vertices_, star.opposite_second, {0.125});
        }
        row.Flush([&](int control_vertex, const std::array<double, 1>& weight) {
          rows.Push(control_vertex, weight);
        });
        rows.EndRow();
      }
    };
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<SparseRows<1>> blocks,
                             (InBlocks<1, SparseRows<1>>(parent.edge_count(), make)));
    edge_vertices_ = SparseRows<1>();
    for (const SparseRows<1>& rows : blocks) edge_vertices_.Append(rows);
    return absl::OkStatus();
  }

  absl::Status MoveOldVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    return ParallelFor(parent.vertex_count, kVerticesPerBlock, context_,
                       [&](int64_t begin, int64_t end) {
                         for (int64_t v = begin; v < end; ++v) {
                           const VertexRule rule = RuleOfVertex(parent, static_cast<int>(v));
                           for (int i = vertices_.begin[v]; i < vertices_.begin[v + 1]; ++i) {
                             const auto [self, ring] = vertices_.weights[i];
                             vertices_.weights[i] = {rule.self * self + rule.ring * ring,
                                                     rule.sum_self * self + rule.sum_ring * ring};
                           }
                         }
                       });
  }

  absl::Status LimitsOfEdgeVertices(int level) {
    const MeshTopology& parent = refinement_.levels[level];
    const LoopLimitMask regular = InteriorLimitMask(6), border = BoundaryLimitMask(4);
    const auto make = [&](RowAccumulator<4>& row, int begin, int end, Block& block) {
      Reserve(end - begin, level + 1, block);
      for (int e = begin; e < end; ++e) {
        const EdgeStar star = StarOfEdge(parent, e);
        const std::array<int, 6> ring = RingOfEdgeVertex(star, parent.vertex_count);
        const LoopLimitMask& mask = star.boundary() ? border : regular;
        row.AddRow(edge_vertices_, e, {1.0, 0.0, mask.tangent_u_self, mask.tangent_v_self});
        for (size_t i = 0; i < mask.position.size(); ++i) {
          const std::array<double, 4> factors = {0.0, mask.position[i] != 0.0 ? 1.0 : 0.0,
                                                 mask.tangent_u[i], mask.tangent_v[i]};
          if (ring[i] < parent.vertex_count) {
            row.AddRow(vertices_, ring[i], factors);
          } else {
            row.AddRow(edge_vertices_, ring[i] - parent.vertex_count, factors);
          }
        }
        Flush(row, mask.position_self, mask.position.front(), level + 1, block);
      }
    };
    return Append(InBlocks<4, Block>(parent.edge_count(), make));
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

  absl::Status Append(const absl::StatusOr<std::vector<Block>>& blocks) {
    if (!blocks.ok()) return blocks.status();
    int64_t entries = static_cast<int64_t>(limits_.control_vertices.size());
    for (const Block& block : *blocks) entries += block.limits.control_vertices.size();
    if (entries > std::numeric_limits<int>::max()) {
      return absl::ResourceExhaustedError("the limit stencils have more than 2^31 - 1 entries");
    }
    for (const Block& block : *blocks) {
      vertices_.Append(block.vertices);
      AppendBegins(block.limits.begin, limits_.begin);
      AppendAll(block.limits.control_vertices, limits_.control_vertices);
      AppendAll(block.limits.position, limits_.position);
      AppendAll(block.limits.tangent_u, limits_.tangent_u);
      AppendAll(block.limits.tangent_v, limits_.tangent_v);
    }
    return absl::OkStatus();
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
  return StencilPropagation(refinement, level, context).Run();
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
