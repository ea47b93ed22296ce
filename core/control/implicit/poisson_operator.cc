#include "core/control/implicit/poisson_operator.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/ablation.h"
#include "core/base/freed_memory.h"
#include "core/control/implicit/sparse_grid.h"
#include "core/control/implicit/splat_samples.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Fields = std::array<std::vector<float>, 4>;

constexpr size_t kSamplesAtOnce = 4096;  // whose discs are held at a time
constexpr int kNoNode = -1;

// How far the normals around a point agree, in [0, 1]. Where sheets of opposite normals share the
// cells of this level their fluxes cancel; the points must not hold the function at 0 there, or a
// finer level, which can tell the sheets apart, would start from a border without a side.
float Coherence(const Fields& spread, const Vector3d& at, const NodesAround& around) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int part = 0; part < 4; ++part) {
    Vector3d shifted = at;
    if (part < 3) shifted[part] -= 0.5;
    const Trilinear gather(shifted);
    const std::array<int, 8> nodes = around.Cell(gather.base);
    for (int corner = 0; corner < 8; ++corner) {
      if (nodes[corner] < 0) continue;
      sum[part] += gather.weight[corner] * spread[part][nodes[corner]];
    }
  }
  if (sum[3] <= 0) return 0;
  if (IsLeftOut(Mechanism::kCoherence)) return 1;
  const double ratio = std::min(1.0, sum.head<3>().norm() / sum[3]);
  return static_cast<float>(ratio * ratio);
}

}  // namespace

PoissonOperator::PoissonOperator(const ScreenedPoisson& system, const RunContext& context)
    : context_(context), size_(system.grid.size()), neighbors_(system.grid, context) {
  FindDegrees(system.border_free);
  {
    const Fields spread = Spread(system);
    // What the discs took would lie beneath all that follows.
    ReleaseToOsAfter(system.cloud.points.cols());
    right_side_.resize(size_);
    Run(size_, [&](int64_t begin, int64_t end) {
      neighbors_.ForEach(begin, end, [&](int node, const Neighbors& neighbors) {
        right_side_[node] = Divergence(spread, node, neighbors);
      });
    });
    AddScreening(system, spread);
  }
  TransposeScreening();
  FindDiagonal();
}

void PoissonOperator::FindDegrees(bool border_free) {
  degree_.resize(size_);
  Run(size_, [&](int64_t begin, int64_t end) {
    neighbors_.ForEach(begin, end, [&](int node, const Neighbors& neighbors) {
      const auto missing = std::count(neighbors.begin(), neighbors.end(), size_);
      const bool is_free = border_free || missing == 0;
      degree_[node] = static_cast<uint8_t>(is_free ? 6 - missing : 0);
    });
  });
}

PoissonOperator::Fields PoissonOperator::Spread(const ScreenedPoisson& system) const {
  Fields spread;
  for (std::vector<float>& field : spread) field.assign(size_, 0.0f);
  const size_t count = system.samples.points.size();
  SampleSplats discs(system);
  for (size_t begin = 0; begin < count; begin += kSamplesAtOnce) {
    if (!discs.Take(begin, std::min(kSamplesAtOnce, count - begin), context_).ok()) break;
    ParallelFor(4, 1, context_, [&](int64_t first, int64_t last) {
      for (int64_t part = first; part < last; ++part) {
        discs.Add(static_cast<int>(part), &spread[part]);
      }
    }).IgnoreError();
  }
  return spread;
}

// Of the normals spread on the edges around a node; edges that leave the grid carry none.
float PoissonOperator::Divergence(const Fields& spread, int node,
                                  const Neighbors& neighbors) const {
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int before = neighbors[2 * axis], after = neighbors[2 * axis + 1];
    if (before < size_) sum += spread[axis][before];
    if (after < size_) sum -= spread[axis][node];
  }
  return sum;
}

// A row for each sample but those at the rim of the grid, where corners are missing. ActiveSamples
// in the same cell mostly follow each other and share its corners.
void PoissonOperator::AddScreening(const ScreenedPoisson& system, const Fields& spread) {
  const size_t count = system.samples.points.size();
  cells_.reserve(count);  // at most; pages not touched take no room
  row_weights_.reserve(count);
  std::vector<ScreeningRow> rows;
  for (size_t begin = 0; begin < count; begin += kBlock) {
    rows.resize(std::min<size_t>(kBlock, count - begin));
    if (!MakeScreeningRows(system, begin, spread, &rows).ok()) break;
    for (size_t m = 0; m < rows.size(); ++m) {
      const ScreeningRow& row = rows[m];
      if (row.nodes[0] == kNoNode) continue;
      if (cells_.empty() || cells_.back()[0] != row.nodes[0]) {
        cells_.push_back(row.nodes);
        first_row_.push_back(static_cast<uint32_t>(row_weights_.size()));
      }
      row_weights_.push_back(row.weights);
    }
  }
  first_row_.push_back(static_cast<uint32_t>(row_weights_.size()));
}

// Of as many samples of `system` from `begin` on.
absl::Status PoissonOperator::MakeScreeningRows(const ScreenedPoisson& system, size_t begin,
                                                const Fields& spread,
                                                std::vector<ScreeningRow>* rows) const {
  const auto make = [&](size_t sample, const NodesAround& around) {
    const Vector3d at = system.LatticePoint(sample);
    const Trilinear weights(at);
    ScreeningRow row{around.Cell(weights.base), weights.weight};
    if (*std::min_element(row.nodes.begin(), row.nodes.end()) < 0) {
      row.nodes[0] = kNoNode;
      return row;
    }
    const double spacing = system.SpacingInCells(sample);
    const auto root =
        static_cast<float>(std::sqrt(system.screening * Coherence(spread, at, around) *
                                     std::numbers::pi / 4 * spacing * spacing));
    for (float& weight : row.weights) weight *= root;
    return row;
  };
  return ParallelFor(static_cast<int64_t>(rows->size()), kSearchBlock, context_,
                     [&](int64_t first, int64_t last) {
                       SparseGridReader grid(system.grid);
                       NodesAround around;
                       for (int64_t m = first; m < last; ++m) {
                         around.MoveTo(system.LatticePoint(begin + m), &grid);
                         (*rows)[m] = make(begin + m, around);
                       }
                     });
}

// The cells that each node is in.
void PoissonOperator::TransposeScreening() {
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
}

// The neighbors there are, and what the rows add.
void PoissonOperator::FindDiagonal() {
  diagonal_.resize(size_);
  at_rows_.resize(row_weights_.size());
  Run(size_, [&](int64_t begin, int64_t end) {
    neighbors_.ForEach(begin, end, [&](int node, const Neighbors& neighbors) {
      const auto missing = std::count(neighbors.begin(), neighbors.end(), size_);
      diagonal_[node] = static_cast<float>(6 - missing) +
                        AtCells(node, [](uint32_t, float weight) { return weight * weight; });
    });
  });
}

}  // namespace rilievo
