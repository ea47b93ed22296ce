// The matrix and the right-hand side of one level of the screened Poisson problem.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/run_context.h"
#include "core/control/implicit/poisson_solver.h"
#include "core/control/implicit/sparse_grid.h"
#include "core/control/implicit/trilinear_stencil.h"

namespace rilievo {

// The graph Laplacian of the grid, plus the screening as its two factors. A stop request leaves its
// numbers half done; the caller asks context.CheckStop() after.
class PoissonOperator {
 public:
  static constexpr int64_t kBlock = 1 << 14;  // nodes a task; sums are formed block by block

  // Reads `system` here only, but for its grid, which must outlive it.
  PoissonOperator(const ScreenedPoisson& system, const RunContext& context);

  int size() const { return size_; }
  std::vector<float> TakeRightSide() { return std::move(right_side_); }
  bool is_free(int64_t node) const { return degree_[node] != 0; }
  float diagonal(int64_t node) const { return diagonal_[node]; }

  // out = A in; frozen nodes give 0. Returns the product of both. `in` ends with a 0, the value
  // where a neighbor is missing.
  double Apply(const std::vector<float>& in, std::vector<float>* out) {
    Run(cell_count(), [&](int64_t begin, int64_t end) {
      for (int64_t cell = begin; cell < end; ++cell) Screen(cell, in);
    });
    return BlockSums([&](int64_t begin, int64_t end) {
      Sums sums{};
      neighbors_.ForEach(begin, end, [&](int node, const Neighbors& neighbors) {
        const float value = is_free(node) ? Row(node, neighbors, in) : 0.0f;
        (*out)[node] = value;
        sums[0] += double{in[node]} * double{value};
      });
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

  template <typename Body>
  void Run(int64_t count, const Body& body) {
    ParallelFor(count, kBlock, context_, body).IgnoreError();
  }

 private:
  using Corners = std::array<float, 8>;
  using Neighbors = std::array<int, 6>;
  // Three components of the normals on the staggered edges, then the bare area on the nodes.
  using Fields = std::array<std::vector<float>, 4>;
  struct ScreeningRow {
    std::array<int, 8> nodes;
    Corners weights;  // trilinear, times the root of the screening
  };

  // The values of the rows of a cell.
  void Screen(int64_t cell, const std::vector<float>& in) {
    Corners at_corners;
    for (int k = 0; k < 8; ++k) at_corners[k] = in[cells_[cell][k]];
    for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
      const Corners& weights = row_weights_[row];
      std::array<float, 4> parts;
      for (int k = 0; k < 4; ++k) {
        parts[k] = weights[k] * at_corners[k] + weights[k + 4] * at_corners[k + 4];
      }
      at_rows_[row] = (parts[0] + parts[1]) + (parts[2] + parts[3]);
    }
  }

  float Row(int64_t node, const Neighbors& neighbors, const std::vector<float>& in) const {
    float sum = 0;
    for (const int neighbor : neighbors) sum += in[neighbor];
    return static_cast<float>(degree_[node]) * in[node] - sum +
           AtCells(node, [&](uint32_t row, float weight) { return at_rows_[row] * weight; });
  }

  // The sum of what the rows of the cells around a node have for it: value(row, weight) each.
  template <typename Value>
  float AtCells(int64_t node, const Value& value) const {
    float sum = 0;
    for (uint32_t e = entry_begin_[node]; e < entry_begin_[node + 1]; ++e) {
      const uint32_t cell = entries_[e] / 8, corner = entries_[e] % 8;
      float of_cell = 0;
      for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
        of_cell += value(row, row_weights_[row][corner]);
      }
      sum += of_cell;
    }
    return sum;
  }

  void FindDegrees(bool border_free);
  Fields Spread(const ScreenedPoisson& system) const;
  float Divergence(const Fields& spread, int node, const Neighbors& neighbors) const;
  void AddScreening(const ScreenedPoisson& system, const Fields& spread);
  absl::Status MakeScreeningRows(const ScreenedPoisson& system, size_t begin, const Fields& spread,
                                 std::vector<ScreeningRow>* rows) const;
  void TransposeScreening();
  void FindDiagonal();
  int64_t cell_count() const { return static_cast<int64_t>(cells_.size()); }

  const RunContext& context_;
  int size_;
  SparseGridNeighbors neighbors_;
  std::vector<uint8_t> degree_;  // 0: frozen
  std::vector<float> diagonal_, right_side_;
  // The screening: rows of 8 weights, those of cell c from first_row_[c] on. A cell that the
  // samples come back to is there more than once.
  std::vector<std::array<int, 8>> cells_;  // their corners
  std::vector<uint32_t> first_row_;
  std::vector<Corners> row_weights_;
  std::vector<float> at_rows_;
  std::vector<uint32_t> entry_begin_;  // by node
  std::vector<uint32_t> entries_;      // 8 cell + corner, ascending
  std::vector<Sums> block_sums_;
};

}  // namespace rilievo
