#include "core/control/implicit/grid_hierarchy.h"

#include <array>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Eigen::Vector3i;

// Value of the coarser level at a node of the finer one: the mean of its 1, 2, 4 or 8 parents.
float Prolong(const GridLevel& coarse, const Vector3i& node) {
  const Vector3i low(node.x() >> 1, node.y() >> 1, node.z() >> 1);
  const Vector3i odd(node.x() & 1, node.y() & 1, node.z() & 1);
  double sum = 0;
  for (int x = 0; x <= odd.x(); ++x) {
    for (int y = 0; y <= odd.y(); ++y) {
      for (int z = 0; z <= odd.z(); ++z) {
        sum += coarse.values[coarse.grid.Find(low + Vector3i(x, y, z))];
      }
    }
  }
  return static_cast<float>(sum / ((1 + odd.x()) * (1 + odd.y()) * (1 + odd.z())));
}

Vector3i Halved(const Vector3i& cell) { return {cell.x() >> 1, cell.y() >> 1, cell.z() >> 1}; }

}  // namespace

double GridLevel::ValueAt(const Eigen::Vector3d& origin, const Eigen::Vector3d& position) const {
  const Eigen::Vector3d lattice = (position - origin) / cell;
  const Eigen::Vector3d floor = lattice.array().floor();
  const Eigen::Vector3d t = lattice - floor;
  std::array<int, 8> corners;
  if (!grid.FindCell(floor.cast<int>(), &corners)) return 0;
  double value = 0;
  for (int c = 0; c < 8; ++c) {
    const double weight = ((c & 1) ? t.x() : 1 - t.x()) * ((c & 2) ? t.y() : 1 - t.y()) *
                          ((c & 4) ? t.z() : 1 - t.z());
    value += weight * values[corners[c]];
  }
  return value;
}

absl::StatusOr<std::vector<SparseGrid>> CellsToRefine(const Eigen::Matrix3Xd& points,
                                                      const std::vector<uint8_t>& level_of_point,
                                                      const Eigen::Vector3d& origin,
                                                      double coarsest_cell, int level_count,
                                                      int band_cells, const RunContext& context) {
  const Vector3i reach = Vector3i::Constant(band_cells);
  std::vector<SparseGrid> cells(level_count - 1);
  for (int level = level_count - 2; level >= 0; --level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    SparseGrid& cut = cells[level];
    const double fine_cell = coarsest_cell / (2 << level);
    Vector3i last = Vector3i::Constant(1 << 30);
    for (int64_t i = 0; i < points.cols(); ++i) {
      if (level_of_point[i] <= level) continue;
      const Vector3i at = ((points.col(i) - origin) / fine_cell).array().floor().cast<int>();
      if (at == last) continue;
      last = at;
      cut.AddBox(Halved(at - reach + Vector3i::Ones()), Halved(at + reach - Vector3i::Ones()));
    }
    if (level + 2 < level_count) {
      for (const Vector3i& cell : cells[level + 1].Nodes()) {
        cut.AddBox(Halved(cell - Vector3i::Ones()), Halved(cell + Vector3i::Ones()));
      }
    }
    cut.Seal();
  }
  return cells;
}

absl::StatusOr<GridLevel> RefineCells(const GridLevel& coarse, const SparseGrid& cells,
                                      const RunContext& context) {
  GridLevel fine;
  fine.cell = coarse.cell / 2;
  std::array<int, 8> corners;
  SparseGridReader reader(coarse.grid);
  for (const Vector3i& cell : cells.Nodes()) {
    if (!reader.FindCell(cell, &corners)) continue;
    fine.grid.AddBox(2 * cell, 2 * cell + Vector3i::Constant(2));
  }
  fine.grid.Seal();
  const std::vector<Vector3i> nodes = fine.grid.Nodes();
  fine.values.resize(nodes.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(static_cast<int64_t>(nodes.size()), kLightBlock, context,
                      [&](int64_t i) { fine.values[i] = Prolong(coarse, nodes[i]); }));
  return fine;
}

absl::Status InjectValues(const GridLevel& fine, const RunContext& context, GridLevel* coarse) {
  const std::vector<Vector3i> nodes = coarse->grid.Nodes();
  return ParallelForEach(static_cast<int64_t>(nodes.size()), kLightBlock, context, [&](int64_t i) {
    const int node = fine.grid.Find(2 * nodes[i]);
    if (node >= 0) coarse->values[i] = fine.values[node];
  });
}

}  // namespace rilievo
