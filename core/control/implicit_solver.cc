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

namespace rilievo {
namespace {

constexpr int64_t kBlock = 1 << 14;   // nodes a task; sums are formed block by block
constexpr double kDiscRadius = 0.75;  // of a point's spacing: discs overlap about twice
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
  bool is_free(int node) const { return free_[node] != 0; }
  float diagonal(int node) const { return diagonal_[node]; }

  // out = A in; frozen nodes give 0.
  void Apply(const std::vector<float>& in, std::vector<float>* out) {
    Run(cell_count(), [&](int64_t begin, int64_t end) {
      for (int64_t cell = begin; cell < end; ++cell) {
        std::array<float, 8> at_corners;
        for (int corner = 0; corner < 8; ++corner) at_corners[corner] = in[cells_[cell][corner]];
        for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
          float sum = 0;
          for (int corner = 0; corner < 8; ++corner) {
            sum += row_weights_[row][corner] * at_corners[corner];
          }
          at_rows_[row] = screen_weight_[row] * sum;
        }
      }
    });
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) {
        (*out)[node] = free_[node] ? Row(static_cast<int>(node), in) : 0.0f;
      }
    });
  }

  // Deterministic for any number of threads: block sums, added in order.
  double Dot(const std::vector<float>& a, const std::vector<float>& b) {
    block_sums_.assign((size_ + kBlock - 1) / kBlock, 0.0);
    Run(size_, [&](int64_t begin, int64_t end) {
      double sum = 0;
      for (int64_t i = begin; i < end; ++i) sum += double{a[i]} * double{b[i]};
      block_sums_[begin / kBlock] = sum;
    });
    double sum = 0;
    for (const double part : block_sums_) sum += part;
    return sum;
  }

  // A stop request leaves the numbers half done; the caller asks context.CheckStop() after.
  template <typename Body>
  void Run(int64_t count, const Body& body) {
    ParallelFor(count, kBlock, context_, body).IgnoreError();
  }

 private:
  float Row(int node, const std::vector<float>& in) const {
    const int* neighbor = &neighbors_[6 * static_cast<size_t>(node)];
    float sum = 0;
    float count = 0;
    for (int side = 0; side < 6; ++side) {
      if (neighbor[side] < 0) continue;
      sum += in[neighbor[side]];
      count += 1;
    }
    float value = count * in[node] - sum;
    for (uint32_t e = entry_begin_[node]; e < entry_begin_[node + 1]; ++e) {
      const auto [cell, corner] = entries_[e];
      for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
        value += row_weights_[row][corner] * at_rows_[row];
      }
    }
    return value;
  }

  void LinkNeighbors(const ScreenedPoisson& system) {
    neighbors_ = system.grid.Neighbors(context_);
    free_.resize(size_);
    diagonal_.resize(size_);
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) {
        const int* neighbor = &neighbors_[6 * static_cast<size_t>(node)];
        const auto degree = std::count_if(neighbor, neighbor + 6, [](int n) { return n >= 0; });
        diagonal_[node] = static_cast<float>(degree);
        free_[node] = system.border_free || degree == 6;
      }
    });
  }

  // The right-hand side (divergence of the spread normals) and the screening rows.
  void ReadPoints(const ScreenedPoisson& system) {
    // Three components of the normals on the staggered edges, then the bare area on the nodes.
    Fields spread;
    for (std::vector<float>& field : spread) field.assign(size_, 0.0f);
    const size_t count = system.speakers.points.size();
    std::vector<NodesAround> around;
    for (size_t begin = 0; begin < count; begin += kBlock) {
      if (!FindNodes(system, begin, &around)) break;
      ParallelFor(4, 1, context_, [&](int64_t first, int64_t last) {
        for (int64_t part = first; part < last; ++part) {
          Spread(system, begin, around, static_cast<int>(part), &spread[part]);
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
      if (before >= 0) sum += spread[axis][before];
      if (after >= 0) sum -= spread[axis][node];
    }
    return sum;
  }

  // A row for each speaker but those at the rim of the grid, where corners are missing. Speakers in
  // the same cell mostly follow each other and share its corners.
  void AddScreening(const ScreenedPoisson& system, const Fields& spread) {
    const size_t count = system.speakers.points.size();
    cells_.reserve(count);  // at most; pages not touched take no room
    row_weights_.reserve(count);
    screen_weight_.reserve(count);
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
        screen_weight_.push_back(row.screen_weight);
      }
    }
    first_row_.push_back(static_cast<uint32_t>(row_weights_.size()));
    at_rows_.resize(row_weights_.size());
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

  // Adds a block of speakers. part 0, 1, 2: one component of the normals, weighted by area, on the
  // edges that run along that axis, each kept with the node it starts from. part 3: the area
  // itself, on the nodes.
  void Spread(const ScreenedPoisson& system, size_t begin, const std::vector<NodesAround>& around,
              int part, std::vector<float>* field) const {
    std::array<int, 8> nodes;
    std::vector<Eigen::Vector3d> disc;
    ImplicitGridReader grid(system.grid);
    for (size_t m = 0; m < around.size(); ++m) {
      const int i = system.speakers.points[begin + m];
      Eigen::Vector3d at = LatticePoint(system, begin + m);
      if (part < 3) at[part] -= 0.5;
      const double spacing = system.speakers.spacing[begin + m] / system.cell;
      TangentDisc(system.cloud.normals.col(i), kDiscRadius * spacing, &disc);
      const double area = std::numbers::pi / 4 * spacing * spacing;  // in cell units
      const double share = part < 3 ? system.sides[i] * system.cloud.normals(part, i) : 1.0;
      const auto amount = static_cast<float>(area * share / static_cast<double>(disc.size()));
      for (const Eigen::Vector3d& offset : disc) {
        const Trilinear weights(at + offset);
        if (disc.size() == 1) {
          nodes = around[m].Cell(weights.base);
        } else {
          grid.FindCell(weights.base, &nodes);
        }
        for (int corner = 0; corner < 8; ++corner) {
          if (nodes[corner] >= 0) (*field)[nodes[corner]] += weights.weight[corner] * amount;
        }
      }
    }
  }

  struct ScreeningRow {
    std::array<int, 8> nodes;
    std::array<float, 8> weights;
    float screen_weight;
  };

  static ScreeningRow MakeScreeningRow(const ScreenedPoisson& system, const Fields& spread,
                                       const NodesAround& around, size_t speaker) {
    const Eigen::Vector3d at = LatticePoint(system, speaker);
    const Trilinear weights(at);
    ScreeningRow row{around.Cell(weights.base), weights.weight, 0};
    if (*std::min_element(row.nodes.begin(), row.nodes.end()) < 0) {
      row.nodes[0] = kNoNode;
      return row;
    }
    const double spacing = system.speakers.spacing[speaker] / system.cell;
    row.screen_weight = static_cast<float>(system.screening * Coherence(spread, at, around) *
                                           std::numbers::pi / 4 * spacing * spacing);
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
        entries_[entry_begin_[cells_[cell][corner]]++] = {cell, corner};
      }
    }
    std::copy_backward(entry_begin_.begin(), entry_begin_.end() - 1, entry_begin_.end());
    entry_begin_.front() = 0;
    Run(size_, [&](int64_t begin, int64_t end) {
      for (int64_t node = begin; node < end; ++node) {
        for (uint32_t e = entry_begin_[node]; e < entry_begin_[node + 1]; ++e) {
          const auto [cell, corner] = entries_[e];
          for (uint32_t row = first_row_[cell]; row < first_row_[cell + 1]; ++row) {
            const float weight = row_weights_[row][corner];
            diagonal_[node] += screen_weight_[row] * weight * weight;
          }
        }
      }
    });
  }

  int64_t cell_count() const { return static_cast<int64_t>(cells_.size()); }

  const RunContext& context_;
  int size_;
  std::vector<int> neighbors_;  // 6 a node, -1 for none
  std::vector<uint8_t> free_;
  std::vector<float> diagonal_, right_side_;
  // The screening: rows of 8 weights, those of cell c from first_row_[c] on. A cell that the
  // speakers come back to is there more than once.
  std::vector<std::array<int, 8>> cells_;  // their corners
  std::vector<uint32_t> first_row_;
  std::vector<std::array<float, 8>> row_weights_;
  std::vector<float> screen_weight_, at_rows_;
  struct Entry {
    uint32_t cell : 29, corner : 3;
  };
  std::vector<uint32_t> entry_begin_;  // by node
  std::vector<Entry> entries_;         // cells ascending
  std::vector<double> block_sums_;
};

}  // namespace

absl::Status SolveScreenedPoisson(const ScreenedPoisson& system, const RunContext& context,
                                  std::vector<float>* values) {
  PoissonOperator matrix(system, context);
  const int size = matrix.size();
  std::vector<float>& x = *values;
  std::vector<float> residual = matrix.TakeRightSide();
  const double goal = kRelativeResidual * kRelativeResidual * matrix.Dot(residual, residual);
  std::vector<float> direction(size, 0.0f), image(size);
  matrix.Apply(x, &image);
  matrix.Run(size, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      residual[i] = matrix.is_free(int(i)) ? residual[i] - image[i] : 0.0f;
    }
  });
  double old_product = 0;
  for (int iteration = 0; iteration < system.iterations; ++iteration) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    // The image is not asked for again; until the next one it holds the scaled residual.
    std::vector<float>& scaled = image;
    matrix.Run(size, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) scaled[i] = residual[i] / matrix.diagonal(int(i));
    });
    const double product = matrix.Dot(residual, scaled);
    if (product <= 0 || matrix.Dot(residual, residual) <= goal) break;
    const float beta = iteration == 0 ? 0.0f : static_cast<float>(product / old_product);
    old_product = product;
    matrix.Run(size, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) direction[i] = scaled[i] + beta * direction[i];
    });
    matrix.Apply(direction, &image);
    const double curvature = matrix.Dot(direction, image);
    if (curvature <= 0) break;
    const float alpha = static_cast<float>(product / curvature);
    matrix.Run(size, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        x[i] += alpha * direction[i];
        residual[i] -= alpha * image[i];
      }
    });
  }
  return context.CheckStop();
}

}  // namespace rilievo
