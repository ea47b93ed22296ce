#include "core/control/implicit/implicit_function.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/control/implicit/poisson_solver.h"
#include "core/control/implicit/settings.h"
#include "core/control/implicit/sizing_field.h"

namespace rilievo {
namespace {

GridLevel CoarsestLevel(const OrientedCloud& cloud, const Eigen::Vector3d& origin, double cell) {
  GridLevel level;
  level.cell = cell;
  const Eigen::Vector3d low = cloud.points.rowwise().minCoeff();
  const Eigen::Vector3d high = cloud.points.rowwise().maxCoeff();
  const Eigen::Vector3i padding = Eigen::Vector3i::Constant(kImplicitFunction.padding_cells);
  level.grid.AddBox(level.CellOf(origin, low) - padding, level.CellOf(origin, high) + padding);
  level.grid.Seal();
  // Outside, until the points say otherwise.
  level.values.assign(level.grid.size(), 0.5f);
  return level;
}

// The levels of the grid, and the one each point asks for.
struct LevelPlan {
  int count = 1;
  double coarsest_cell = 0;
  std::vector<uint8_t> of_point;
};

// The cells are those most points ask for, doubled and halved.
LevelPlan PlanLevels(const std::vector<float>& wanted_cells) {
  const double smallest =
      1.0 / (kImplicitFunction.coarsest_cells * (1 << (kImplicitFunction.max_levels - 1)));
  const double usual =
      std::clamp<double>(Median(wanted_cells), smallest, 1.0 / kImplicitFunction.coarsest_cells);
  // Rounded where the points ask for less than usual; no cell is larger than asked for.
  const auto halvings = [&](float wanted) {
    const double exact = std::log2(usual / std::max<double>(wanted, smallest));
    return static_cast<int>(exact > 0 ? std::lround(exact) : std::ceil(exact));
  };
  const int usual_depth =
      static_cast<int>(std::lround(std::log2(1.0 / (kImplicitFunction.coarsest_cells * usual))));
  const int finest = halvings(*std::min_element(wanted_cells.begin(), wanted_cells.end()));
  LevelPlan plan;
  plan.of_point.reserve(wanted_cells.size());
  plan.count = std::clamp(1 + usual_depth + finest, 1, kImplicitFunction.max_levels);
  plan.coarsest_cell = usual * (1 << usual_depth);
  for (const float wanted : wanted_cells) {
    plan.of_point.push_back(
        static_cast<uint8_t>(std::clamp(usual_depth + halvings(wanted), 0, plan.count - 1)));
  }
  return plan;
}

// Leaves out finest levels that would make too many nodes.
void BoundNodes(LevelPlan* plan, std::vector<SparseGrid>* refined) {
  const auto points = static_cast<int64_t>(plan->of_point.size());
  int64_t nodes = 0;
  for (const SparseGrid& cells : *refined) nodes += kImplicitFunction.nodes_of_cell * cells.size();
  while (nodes > MostImplicitNodes(points)) {
    nodes -= kImplicitFunction.nodes_of_cell * refined->back().size();
    refined->pop_back();
    --plan->count;
  }
  for (uint8_t& level : plan->of_point) {
    level = std::min(level, static_cast<uint8_t>(plan->count - 1));
  }
}

// Flips the normals that point down the function, which are inconsistent with the field of their
// neighbours (in the spirit of Hou et al. 2022, iterative Poisson reconstruction). Ambiguous
// normals, whose weight was zero so far, take the side that the function gives them. Looks at the
// points of the finest level that exists so far. Returns how many changed.
absl::StatusOr<int64_t> FlipInconsistentNormals(const OrientedCloud& cloud, const LevelPlan& plan,
                                                const RunContext& context,
                                                ImplicitFunction* function) {
  const GridLevel& level = function->levels.back();
  const Eigen::Vector3d& origin = function->origin;
  std::vector<int8_t>& sides = function->sides;
  const auto count = static_cast<int64_t>(sides.size());
  const auto levels = static_cast<int>(function->levels.size());
  std::atomic<int64_t> changed = 0;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kLightBlock, context, [&](int64_t begin, int64_t end) {
    int64_t changed_here = 0;
    for (int64_t i = begin; i < end; ++i) {
      if (plan.of_point[i] + 1 != levels) continue;
      const Eigen::Vector3d point = cloud.points.col(i);
      const bool silent = sides[i] == 0;
      if (silent) sides[i] = 1;
      const Eigen::Vector3d step =
          kImplicitFunction.probe_cells * level.cell * sides[i] * cloud.normals.col(i);
      const double rise = level.ValueAt(origin, point + step) - level.ValueAt(origin, point - step);
      const bool turn = rise < (silent ? 0 : -kImplicitFunction.inconsistent_drop) &&
                        (silent || !IsLeftOut(Mechanism::kInconsistentNormals));
      if (turn) sides[i] = static_cast<int8_t>(-sides[i]);
      changed_here += turn || silent ? 1 : 0;
    }
    changed += changed_here;
  }));
  return changed.load();
}

// Ambiguous normals start with weight zero.
std::vector<int8_t> SureSides(const OrientedCloud& cloud) {
  std::vector<int8_t> sides(static_cast<size_t>(cloud.points.cols()), 1);
  for (size_t i = 0; i < cloud.ambiguous.size(); ++i) {
    if (cloud.ambiguous[i] != 0) sides[i] = 0;
  }
  return sides;
}

// Whether the grid has any corner of a cell.
bool TouchesCell(const Eigen::Vector3i& cell, SparseGridReader* grid) {
  std::array<int, 8> corners;
  return grid->FindCell(cell, &corners) || *std::max_element(corners.begin(), corners.end()) >= 0;
}

// Points in reach of a grid whose spacing its cell can follow; where they are many times denser, an
// even share of them.
absl::StatusOr<ActiveSamples> ActiveSamplesOf(const OrientedCloud& cloud, const GridLevel& level,
                                              const Eigen::Vector3d& origin, bool all,
                                              const RunContext& context) {
  std::vector<int> strides(static_cast<size_t>(cloud.points.cols()));  // 0: not active
  const auto stride_of = [&](int64_t i) {
    const double spacing = cloud.spacing[i];
    if (!all && spacing > kImplicitFunction.spacing_per_cell * level.cell) return 0;
    const double points_per_cell =
        4 / std::numbers::pi * level.cell * level.cell / (spacing * spacing);
    const int stride =
        std::max(1, static_cast<int>(std::min(points_per_cell / kImplicitFunction.points_per_cell,
                                              kImplicitFunction.most_stride)));
    return i % stride == 0 ? stride : 0;
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(cloud.points.cols(), kLightBlock, context, [&](int64_t begin, int64_t end) {
        // Points are in Morton order: the one before often lies in the same cell.
        std::optional<Eigen::Vector3i> cell_before;
        SparseGridReader grid(level.grid);
        bool in_reach = true;
        for (int64_t i = begin; i < end; ++i) {
          const int stride = stride_of(i);
          if (stride > 0 && !all) {
            const Eigen::Vector3i cell = level.CellOf(origin, cloud.points.col(i));
            if (cell_before != cell) in_reach = TouchesCell(cell, &grid);
            cell_before = cell;
          }
          strides[i] = in_reach ? stride : 0;
        }
      }));
  ActiveSamples samples;
  const auto count = strides.size() - std::count(strides.begin(), strides.end(), 0);
  samples.points.reserve(count);
  samples.spacing.reserve(count);
  for (int i = 0; i < cloud.points.cols(); ++i) {
    if (strides[i] == 0) continue;
    samples.points.push_back(i);
    samples.spacing.push_back(static_cast<float>(cloud.spacing[i] * std::sqrt(strides[i])));
  }
  return samples;
}

// Solves the finest level there is so far.
absl::Status SolveLevel(const OrientedCloud& cloud, const ImplicitOptions& options,
                        const RunContext& context, ImplicitFunction* function) {
  GridLevel& level = function->levels.back();
  const bool coarsest = function->levels.size() == 1;
  RILIEVO_ASSIGN_OR_RETURN(ActiveSamples samples,
                           ActiveSamplesOf(cloud, level, function->origin, coarsest, context));
  return SolvePoisson({.cloud = cloud,
                       .sides = function->sides,
                       .samples = std::move(samples),
                       .grid = level.grid,
                       .origin = function->origin,
                       .cell = level.cell,
                       .screening = options.screening,
                       .border_free = coarsest && !options.closed,
                       .iterations = coarsest ? 80 : 24},
                      context, &level.values);
}

}  // namespace

int64_t MostImplicitNodes(int64_t points) {
  const int64_t first = std::min(points, kImplicitFunction.few_points);
  return kImplicitFunction.nodes_beside + kImplicitFunction.nodes_of_point * first +
         kImplicitFunction.nodes_of_further_point * (points - first);
}

absl::StatusOr<ImplicitFunction> FitImplicitFunction(const OrientedCloud& cloud,
                                                     NeighborGraph graph, const PointIndex& index,
                                                     const ImplicitOptions& options,
                                                     const RunContext& context) {
  if (cloud.points.cols() == 0) return absl::InvalidArgumentError("the cloud holds no points");
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> wanted_cells,
                           SizingField(cloud, graph, index, options, context));
  graph = NeighborGraph();
  LevelPlan plan = PlanLevels(wanted_cells);
  wanted_cells = std::vector<float>();
  ImplicitFunction function;
  function.origin = cloud.points.rowwise().minCoeff();
  function.sides = SureSides(cloud);
  RILIEVO_ASSIGN_OR_RETURN(
      std::vector<SparseGrid> refined,
      CellsToRefine(cloud.points, plan.of_point, function.origin, plan.coarsest_cell, plan.count,
                    options.band_cells, context));
  BoundNodes(&plan, &refined);
  function.levels.push_back(CoarsestLevel(cloud, function.origin, plan.coarsest_cell));
  for (int depth = 0;; ++depth) {
    RILIEVO_RETURN_IF_ERROR(SolveLevel(cloud, options, context, &function));
    RILIEVO_ASSIGN_OR_RETURN(const int64_t changed,
                             FlipInconsistentNormals(cloud, plan, context, &function));
    if (static_cast<double>(changed) >=
        kImplicitFunction.few_turned * static_cast<double>(cloud.points.cols())) {
      RILIEVO_RETURN_IF_ERROR(SolveLevel(cloud, options, context, &function));
    }
    context.Report(Stage::kControlMesh, 0.4 * (depth + 1) / plan.count);
    if (depth + 1 == plan.count) break;
    RILIEVO_ASSIGN_OR_RETURN(GridLevel finer,
                             RefineCells(function.levels.back(), refined[depth], context));
    function.levels.push_back(std::move(finer));
  }
  for (int depth = plan.count - 2; depth >= 0; --depth) {
    RILIEVO_RETURN_IF_ERROR(
        InjectValues(function.levels[depth + 1], context, &function.levels[depth]));
  }
  return function;
}

}  // namespace rilievo
