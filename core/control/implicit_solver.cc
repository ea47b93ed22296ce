#include "core/control/implicit_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/grid_footprint.h"
#include "core/control/spread_discs.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 1 << 14;  // nodes a task; sums are formed block by block
constexpr size_t kSpeakers = 4096;   // whose discs are held at a time
constexpr int kNoNode = -1;
constexpr double kRelativeResidual = 2e-3;  // of the right-hand side; the surface is fitted later

// The matrix: the graph Laplacian of the grid, plus the screening as its two factors.
class PoissonOperator {
 public:
  PoissonOperator(const ScreenedPoisson& system, const RunContext& context)
      : context_(context), size_(system.grid.size()) {
    LinkNeighbors(system);
    ReadPoints(system);
    TransposeScreening();
  }

  int size() const { return size_; }
  // Leaves none behind.
  std::vector<float> TakeRightSide() { return std::move(right_side_); }
  bool is_free(int64_t node) const { return degree_[node] != 0; }
  float diagonal(int64_t node) const { return diagonal_[node]; }

  // out = A in; frozen nodes give 0. Returns the product of both. `in` ends with a 0, the value
  // where a neighbor is missing.
  double Apply(const std::vector<float>& in, std::vector<float>* out) {
    Run(cell_count(), [&](int64_t begin, int64_t end) {
      for (int64_t cell = begin; cell < end; ++cell) at_cells_[cell] = Screen(cell, in);
    });
    return BlockSums([&](int64_t begin, int64_t end) {
      Sums sums{};
      for (int64_t node = begin; node < end; ++node) {
        const float value = is_free(node) ? Row(node, in) : 0.0f;
        (*out)[node] = value;
        sums[0] += double{in[node]} * double{value};
      }
      return sums;
    })[0];
  }

  using Sums = std::array<double, 2>;

  // Of what `body` returns for each block of nodes. Deterministic for any number of threads: added
  // in order.
  template <typename Body>
  Sums BlockSums(const Body& body) {
    block_sums_.assign((size_ + kBlock - 1) / kBlock, Sums{});
    Run(size_, [&](int64_t begin, int64_t end) { block_sums_[begin / kBlock] = body(begin, end); });
    Sums sums{};
    for (const Sums& part : block_sums_) {
      for (size_t k = 0; k < sums.size(); ++k) sums[k] += part[k];
    }
    return sums;
  }

  // A stop request leaves the numbers half done; the caller asks context.CheckStop() after.
  template <typename Body>
  void Run(int64_t count, const Body& body) {
    ParallelFor(count, kBlock, context_, body).IgnoreError();
  }

 private:
  using Corners = std::array<float, 8>;

  // What the rows of a cell give at its corners.
  Corners Screen(int64_t cell, const std::vector<float>& in) const {
    Corners at_corners, sums{};
    for (int k = 0; k < 8; ++k) at_corners[k] = in[cells_[cell][k]];
    for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
      const Corners& weights = row_weights_[row];
      std::array<float, 4> parts;
      for (int k = 0; k < 4; ++k) {
        parts[k] = weights[k] * at_corners[k] + weights[k + 4] * at_corners[k + 4];
      }
      const float value = (parts[0] + parts[1]) + (parts[2] + parts[3]);
      for (int k = 0; k < 8; ++k) sums[k] += value * weights[k];
    }
    return sums;
  }

  float Row(int64_t node, const std::vector<float>& in) const {
    const int* neighbor = &neighbors_[6 * static_cast<size_t>(node)];
    float sum = 0;
    for (int side = 0; side < 6; ++side) sum += in[neighbor[side]];
    return static_cast<float>(degree_[node]) * in[node] - sum + AtCells(node);
  }

  // The sum of what the cells around a node have for it.
  float AtCells(int64_t node) const {
    float sum = 0;
    for (uint32_t e = entry_begin_[node]; e < entry_begin_[node + 1]; ++e) {
      sum += at_cells_[entries_[e] / 8][entries_[e] % 8];
    }
    return sum;
  }

  void LinkNeighbors(const ScreenedPoisson& system) {
    neighbors_ = system.grid.Neighbors(context_);
    degree_.resize(size_);
    diagonal_.resize(size_);
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) {
        int* neighbor = &neighbors_[6 * static_cast<size_t>(node)];
        const auto missing = std::count(neighbor, neighbor + 6, -1);
        std::replace(neighbor, neighbor + 6, -1, size_);
        diagonal_[node] = static_cast<float>(6 - missing);
        const bool is_free = system.border_free || missing == 0;
        degree_[node] = static_cast<uint8_t>(is_free ? 6 - missing : 0);
      }
    });
  }

  // The right-hand side (divergence of the spread normals) and the screening rows.
  void ReadPoints(const ScreenedPoisson& system) {
    // Three components of the normals on the staggered edges, then the bare area on the nodes.
    Fields spread;
    for (std::vector<float>& field : spread) field.assign(size_, 0.0f);
    const size_t count = system.speakers.points.size();
    SpreadDiscs discs(system);
    for (size_t begin = 0; begin < count; begin += kSpeakers) {
      if (!discs.Take(begin, std::min(kSpeakers, count - begin), context_).ok()) break;
      ParallelFor(4, 1, context_, [&](int64_t first, int64_t last) {
        for (int64_t part = first; part < last; ++part) {
          discs.Add(static_cast<int>(part), &spread[part]);
        }
      }).IgnoreError();
    }
    right_side_.resize(size_);
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) right_side_[node] = Divergence(spread, node);
    });
    AddScreening(system, spread);
  }

  using Fields = std::array<std::vector<float>, 4>;

  // Of the normals spread on the edges around a node; edges that leave the grid carry none.
  float Divergence(const Fields& spread, int64_t node) const {
    const int* neighbor = &neighbors_[6 * static_cast<size_t>(node)];
    float sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int before = neighbor[2 * axis], after = neighbor[2 * axis + 1];
      if (before < size_) sum += spread[axis][before];
      if (after < size_) sum -= spread[axis][node];
    }
    return sum;
  }

  // A row for each speaker but those at the rim of the grid, where corners are missing. Speakers in
  // the same cell mostly follow each other and share its corners.
  void AddScreening(const ScreenedPoisson& system, const Fields& spread) {
    const size_t count = system.speakers.points.size();
    cells_.reserve(count);  // at most; pages not touched take no room
    row_weights_.reserve(count);
    std::vector<NodesAround> around;
    std::vector<ScreeningRow> rows;
    for (size_t begin = 0; begin < count; begin += kBlock) {
      if (!FindNodes(system, begin, &around)) break;
      rows.resize(around.size());
      ParallelFor(static_cast<int64_t>(around.size()), 1024, context_,
                  [&](int64_t first, int64_t last) {
                    for (int64_t m = first; m < last; ++m) {
                      rows[m] = MakeScreeningRow(system, spread, around[m], begin + m);
                    }
                  })
          .IgnoreError();
      for (const ScreeningRow& row : rows) {
        if (row.nodes[0] == kNoNode) continue;
        if (cells_.empty() || cells_.back()[0] != row.nodes[0]) {
          cells_.push_back(row.nodes);
          first_row_.push_back(static_cast<uint32_t>(row_weights_.size()));
        }
        row_weights_.push_back(row.weights);
      }
    }
    first_row_.push_back(static_cast<uint32_t>(row_weights_.size()));
    at_cells_.resize(cells_.size());
  }

  static Eigen::Vector3d LatticePoint(const ScreenedPoisson& system, size_t speaker) {
    return (system.cloud.points.col(system.speakers.points[speaker]) - system.origin) / system.cell;
  }

  // Of the speakers from `begin` on, a block at most. False when a stop was asked for.
  bool FindNodes(const ScreenedPoisson& system, size_t begin, std::vector<NodesAround>* around) {
    around->resize(std::min<size_t>(kBlock, system.speakers.points.size() - begin));
    return ParallelFor(static_cast<int64_t>(around->size()), 1024, context_,
                       [&](int64_t first, int64_t last) {
                         ImplicitGridReader grid(system.grid);
                         for (int64_t m = first; m < last; ++m) {
                           NodesAround& nodes = (*around)[m];
                           nodes.low = NodesAround::LowFor(LatticePoint(system, begin + m));
                           // Points are in Morton order: the one before often has the same nodes.
                           if (m > first && nodes.low == (*around)[m - 1].low) {
                             nodes.nodes = (*around)[m - 1].nodes;
                           } else {
                             grid.FindThreeCubed(nodes.low, &nodes.nodes);
                           }
                         }
                       })
        .ok();
  }

  // How far the normals around a point agree, in [0, 1]. Where sheets of opposite normals share the
  // cells of this level their fluxes cancel; the points must not hold the function at 0 there, or a
  // finer level, which can tell the sheets apart, would start from a border without a side.
  static float Coherence(const Fields& spread, const Eigen::Vector3d& at,
                         const NodesAround& around) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int part = 0; part < 4; ++part) {
      Eigen::Vector3d shifted = at;
      if (part < 3) shifted[part] -= 0.5;
      const Trilinear gather(shifted);
      const std::array<int, 8> nodes = around.Cell(gather.base);
      for (int corner = 0; corner < 8; ++corner) {
        if (nodes[corner] < 0) continue;
        sum[part] += gather.weight[corner] * spread[part][nodes[corner]];
      }
    }
    if (sum[3] <= 0) return 0;
    const double ratio = std::min(1.0, sum.head<3>().norm() / sum[3]);
    return static_cast<float>(ratio * ratio);
  }

  struct ScreeningRow {
    std::array<int, 8> nodes;
    Corners weights;  // trilinear, times the root of the screening
  };

  static ScreeningRow MakeScreeningRow(const ScreenedPoisson& system, const Fields& spread,
                                       const NodesAround& around, size_t speaker) {
    const Eigen::Vector3d at = LatticePoint(system, speaker);
    const Trilinear weights(at);
    ScreeningRow row{around.Cell(weights.base), weights.weight};
    if (*std::min_element(row.nodes.begin(), row.nodes.end()) < 0) {
      row.nodes[0] = kNoNode;
      return row;
    }
    const double spacing = system.speakers.spacing[speaker] / system.cell;
    const auto root =
        static_cast<float>(std::sqrt(system.screening * Coherence(spread, at, around) *
                                     std::numbers::pi / 4 * spacing * spacing));
    for (float& weight : row.weights) weight *= root;
    return row;
  }

  // The cells that each node is in, and what their rows add to the diagonal.
  void TransposeScreening() {
    entry_begin_.assign(static_cast<size_t>(size_) + 1, 0);
    for (const std::array<int, 8>& cell : cells_) {
      for (const int node : cell) ++entry_begin_[node + 1];
    }
    for (int node = 0; node < size_; ++node) entry_begin_[node + 1] += entry_begin_[node];
    entries_.resize(entry_begin_.back());
    // Filling moves each begin to the next node's.
    for (uint32_t cell = 0; cell < cells_.size(); ++cell) {
      for (uint32_t corner = 0; corner < 8; ++corner) {
        entries_[entry_begin_[cells_[cell][corner]]++] = 8 * cell + corner;
      }
    }
    std::copy_backward(entry_begin_.begin(), entry_begin_.end() - 1, entry_begin_.end());
    entry_begin_.front() = 0;
    Run(cell_count(), [&](int64_t begin, int64_t end) {
      for (int64_t cell = begin; cell < end; ++cell) at_cells_[cell] = Squares(cell);
    });
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) diagonal_[node] += AtCells(node);
    });
  }

  Corners Squares(int64_t cell) const {
    Corners squares{};
    for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
      for (int k = 0; k < 8; ++k) squares[k] += row_weights_[row][k] * row_weights_[row][k];
    }
    return squares;
  }

  int64_t cell_count() const { return static_cast<int64_t>(cells_.size()); }

  const RunContext& context_;
  int size_;
  std::vector<int> neighbors_;   // 6 a node, size_ for none
  std::vector<uint8_t> degree_;  // 0: frozen
  std::vector<float> diagonal_, right_side_;
  // The screening: rows of 8 weights, those of cell c from first_row_[c] on. A cell that the
  // speakers come back to is there more than once.
  std::vector<std::array<int, 8>> cells_;  // their corners
  std::vector<uint32_t> first_row_;
  std::vector<Corners> row_weights_;
  std::vector<Corners> at_cells_;      // what each has for its corners
  std::vector<uint32_t> entry_begin_;  // by node
  std::vector<uint32_t> entries_;      // its places in at_cells_, ascending
  std::vector<Sums> block_sums_;
};

}  // namespace

absl::Status SolveScreenedPoisson(const ScreenedPoisson& system, const RunContext& context,
                                  std::vector<float>* values) {
  PoissonOperator matrix(system, context);
  const int size = matrix.size();
  std::vector<float>& x = *values;
  std::vector<float> residual = matrix.TakeRightSide();
  // Products of the residual with itself, and with what the preconditioner makes of it.
  const auto products = [&](const auto& update) {
    return matrix.BlockSums([&](int64_t begin, int64_t end) {
      PoissonOperator::Sums sums{};
      for (int64_t i = begin; i < end; ++i) {
        update(i);
        sums[0] += double{residual[i]} * double{residual[i]};
        sums[1] += double{residual[i]} * double{residual[i] / matrix.diagonal(i)};
      }
      return sums;
    });
  };
  const double goal = kRelativeResidual * kRelativeResidual * products([](int64_t) {})[0];
  std::vector<float> direction(static_cast<size_t>(size) + 1, 0.0f), image(size);
  std::copy(x.begin(), x.end(), direction.begin());
  matrix.Apply(direction, &image);
  PoissonOperator::Sums current =
      products([&](int64_t i) { residual[i] = matrix.is_free(i) ? residual[i] - image[i] : 0.0f; });
  double old_product = 0;
  for (int iteration = 0; iteration < system.iterations; ++iteration) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const auto [squared, product] = current;
    if (product <= 0 || squared <= goal) break;
    const float beta = iteration == 0 ? 0.0f : static_cast<float>(product / old_product);
    old_product = product;
    matrix.Run(size, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        direction[i] = residual[i] / matrix.diagonal(i) + beta * direction[i];
      }
    });
    const double curvature = matrix.Apply(direction, &image);
    if (curvature <= 0) break;
    const float alpha = static_cast<float>(product / curvature);
    current = products([&](int64_t i) {
      x[i] += alpha * direction[i];
      residual[i] -= alpha * image[i];
    });
  }
  return context.CheckStop();
}

}  // namespace rilievo
