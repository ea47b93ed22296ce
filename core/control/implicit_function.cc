#include "core/control/implicit_function.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/control/implicit_solver.h"

namespace rilievo {
namespace {

// The coarsest grid has about this many cells along the diagonal.
constexpr double kCoarsestCells = 28;
// Free space around the box of the points at the coarsest level, in cells.
constexpr int kPaddingCells = 5;
constexpr int kMaxLevels = 9;
// A point speaks at a level when its own spacing is at most this many cells.
constexpr double kSpacingPerCell = 2.5;
// So many points are enough for the face of a cell.
constexpr double kPointsPerCell = 5;
constexpr double kMostStride = 1024;
// What makes a neighbour one of another sheet: an opposite normal, and more across than along.
constexpr double kOppositeNormals = -0.7;
constexpr double kAcrossShare = 0.6;
constexpr double kThinShare = 0.002;
// A normal is outvoted when the function, 1 from side to side, falls by this much from this many
// cells behind the point to as many before it.
constexpr double kProbeCells = 0.75;
constexpr double kOutvotedDrop = 0.15;
constexpr int kTurningRounds = 1;
constexpr double kFewTurned = 5e-5;  // of all points: not worth another solution
constexpr double kEvenShare = 0.6;   // of the even spacing, the least the cell follows

struct GridLevel {
  ImplicitGrid grid;
  std::vector<float> values;
  double cell = 0;
};

Eigen::Vector3i CellOf(const Eigen::Vector3d& position, const Eigen::Vector3d& origin,
                       double cell) {
  return ((position - origin) / cell).array().floor().cast<int>();
}

void AddBandAroundPoints(const OrientedCloud& cloud, const std::vector<int>& members,
                         const Eigen::Vector3d& origin, double cell, int band, ImplicitGrid* grid) {
  const Eigen::Vector3i reach = Eigen::Vector3i::Constant(band);
  Eigen::Vector3i last = Eigen::Vector3i::Constant(1 << 30);
  for (const int i : members) {
    const Eigen::Vector3i at = CellOf(cloud.points.col(i), origin, cell);
    if (at == last) continue;
    last = at;
    grid->AddBox(at - reach + Eigen::Vector3i::Ones(), at + reach);
  }
}

// The nodes of a level within `reach_spacings` of a point.
ImplicitGrid NodesInReach(const OrientedCloud& cloud, const Eigen::Vector3d& origin, double cell,
                          double reach_spacings) {
  ImplicitGrid near;
  Eigen::Vector3i last = Eigen::Vector3i::Constant(1 << 30);
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const Eigen::Vector3i at = CellOf(cloud.points.col(i), origin, cell);
    if (at == last) continue;
    last = at;
    const int cells = std::min(12, static_cast<int>(reach_spacings * cloud.spacing[i] / cell) + 1);
    near.AddBox(at - Eigen::Vector3i::Constant(cells), at + Eigen::Vector3i::Constant(cells));
  }
  near.Seal();
  return near;
}

// Cells of the coarser level that its zero set crosses, and one cell around them.
void AddBandAroundZeroSet(const GridLevel& coarse, const ImplicitGrid* reach, ImplicitGrid* grid) {
  std::array<int, 8> corners;
  for (const Eigen::Vector3i& node : coarse.grid.Nodes()) {
    if (reach != nullptr && reach->Find(node) < 0) continue;
    if (!coarse.grid.FindCell(node, &corners)) continue;
    int below = 0;
    for (const int corner : corners) below += coarse.values[corner] < 0;
    if (below == 0 || below == 8) continue;
    grid->AddBox(2 * node - Eigen::Vector3i::Constant(1), 2 * node + Eigen::Vector3i::Constant(3));
  }
}

// Value of the coarser level at a node of the finer one, the mean of its 1, 2, 4 or 8 parents;
// false where a parent is missing.
bool Prolong(const GridLevel& coarse, const Eigen::Vector3i& node, float* value) {
  const Eigen::Vector3i low(node.x() >> 1, node.y() >> 1, node.z() >> 1);
  const Eigen::Vector3i odd(node.x() & 1, node.y() & 1, node.z() & 1);
  double sum = 0;
  for (int x = 0; x <= odd.x(); ++x) {
    for (int y = 0; y <= odd.y(); ++y) {
      for (int z = 0; z <= odd.z(); ++z) {
        const int index = coarse.grid.Find(low + Eigen::Vector3i(x, y, z));
        if (index < 0) return false;
        sum += coarse.values[index];
      }
    }
  }
  *value = static_cast<float>(sum / ((1 + odd.x()) * (1 + odd.y()) * (1 + odd.z())));
  return true;
}

// Keeps the candidates whose parents exist, with the coarser solution as their values.
absl::StatusOr<GridLevel> RefineLevel(const GridLevel& coarse, ImplicitGrid candidates,
                                      const RunContext& context) {
  candidates.Seal();
  const std::vector<Eigen::Vector3i> nodes = candidates.Nodes();
  std::vector<float> values(nodes.size());
  std::vector<uint8_t> keep(nodes.size());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(static_cast<int64_t>(nodes.size()), 1 << 14, context,
                                      [&](int64_t begin, int64_t end) {
                                        for (int64_t i = begin; i < end; ++i) {
                                          keep[i] = Prolong(coarse, nodes[i], &values[i]);
                                        }
                                      }));
  GridLevel fine;
  fine.cell = coarse.cell / 2;
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (keep[i] != 0) fine.values.push_back(values[i]);
  }
  candidates.Filter(keep);
  fine.grid = std::move(candidates);
  return fine;
}

GridLevel CoarsestLevel(const OrientedCloud& cloud, const Eigen::Vector3d& origin, double cell) {
  GridLevel level;
  level.cell = cell;
  const Eigen::Vector3d low = cloud.points.rowwise().minCoeff();
  const Eigen::Vector3d high = cloud.points.rowwise().maxCoeff();
  const Eigen::Vector3i padding = Eigen::Vector3i::Constant(kPaddingCells);
  level.grid.AddBox(CellOf(low, origin, cell) - padding, CellOf(high, origin, cell) + padding);
  level.grid.Seal();
  // Outside, until the points say otherwise.
  level.values.assign(level.grid.size(), 0.5f);
  return level;
}

// The function at any position, trilinear; 0 outside the grid.
double ValueAt(const GridLevel& level, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& position) {
  const Eigen::Vector3d lattice = (position - origin) / level.cell;
  const Eigen::Vector3d floor = lattice.array().floor();
  const Eigen::Vector3d t = lattice - floor;
  std::array<int, 8> corners;
  if (!level.grid.FindCell(floor.cast<int>(), &corners)) return 0;
  double value = 0;
  for (int c = 0; c < 8; ++c) {
    const double weight = ((c & 1) ? t.x() : 1 - t.x()) * ((c & 2) ? t.y() : 1 - t.y()) *
                          ((c & 4) ? t.z() : 1 - t.z());
    value += weight * level.values[corners[c]];
  }
  return value;
}

// Turns the normals that point down the function: their neighbours outvoted them (in the spirit of
// Hou et al. 2022, iterative Poisson reconstruction). Contested normals, which have had no say yet,
// take the side the function gives them. Returns how many changed.
absl::StatusOr<int64_t> TurnOutvotedNormals(const OrientedCloud& cloud, const GridLevel& level,
                                            const Eigen::Vector3d& origin,
                                            const RunContext& context, Eigen::Matrix3Xd* normals) {
  const int64_t count = normals->cols();
  std::vector<uint8_t> changed(static_cast<size_t>(count), 0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, 4096, context, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      auto normal = normals->col(i);
      const bool silent = normal.isZero(0);
      if (silent) normal = cloud.normals.col(i);
      const Eigen::Vector3d point = cloud.points.col(i);
      const Eigen::Vector3d step = kProbeCells * level.cell * normal;
      const double rise =
          ValueAt(level, origin, point + step) - ValueAt(level, origin, point - step);
      const bool turn = rise < (silent ? 0 : -kOutvotedDrop);
      if (turn) normal *= -1;
      changed[i] = turn || silent;
    }
  }));
  return std::count(changed.begin(), changed.end(), 1);
}

// The normals that have a say from the start: contested ones are zero.
Eigen::Matrix3Xd SureNormals(const OrientedCloud& cloud) {
  Eigen::Matrix3Xd normals = cloud.normals;
  for (size_t i = 0; i < cloud.contested.size(); ++i) {
    if (cloud.contested[i] != 0) normals.col(static_cast<int64_t>(i)).setZero();
  }
  return normals;
}

// Points whose spacing a grid of this cell can follow; where they are many times denser, an even
// share of them.
Speakers SpeakersFor(const OrientedCloud& cloud, double cell, bool all) {
  Speakers speakers;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double spacing = cloud.spacing[i];
    if (!all && spacing > kSpacingPerCell * cell) continue;
    const double points_per_cell = 4 / std::numbers::pi * cell * cell / (spacing * spacing);
    const int stride =
        std::max(1, static_cast<int>(std::min(points_per_cell / kPointsPerCell, kMostStride)));
    if (i % stride != 0) continue;
    speakers.points.push_back(i);
    speakers.spacing.push_back(static_cast<float>(spacing * std::sqrt(stride)));
  }
  return speakers;
}

// Distance below which kThinShare of all points have a neighbour of another sheet at their back or
// before their face; infinite when fewer have one at all.
double SheetDistance(const OrientedCloud& cloud, const NeighborGraph& graph) {
  std::vector<double> distances;
  for (int i = 0; i < graph.size(); ++i) {
    const Eigen::Vector3d normal = cloud.normals.col(i);
    for (const int j : graph.neighbors(i)) {
      if (normal.dot(cloud.normals.col(j)) > kOppositeNormals) continue;
      const Eigen::Vector3d chord = cloud.points.col(j) - cloud.points.col(i);
      const double across = std::abs(chord.dot(normal));
      if (across < kAcrossShare * chord.norm()) continue;
      distances.push_back(across);
      break;
    }
  }
  const size_t rank = static_cast<size_t>(kThinShare * graph.size());
  if (distances.size() <= rank) return std::numeric_limits<double>::infinity();
  std::nth_element(distances.begin(), distances.begin() + rank, distances.end());
  return distances[rank];
}

// Spacing of as many points spread evenly over the same area: unlike the median it is not ruled by
// the dense parts of a scan, so the grid stays in proportion to the points.
double EvenSpacing(const OrientedCloud& cloud) {
  double squares = 0;
  for (const float spacing : cloud.spacing) squares += double{spacing} * spacing;
  return std::sqrt(squares / static_cast<double>(cloud.spacing.size()));
}

double FinestCell(const OrientedCloud& cloud, const NeighborGraph& graph,
                  const ImplicitOptions& options) {
  const double smallest = 1.0 / (kCoarsestCells * (1 << (kMaxLevels - 1)));
  const double spacing = std::max(cloud.median_spacing, kEvenShare * EvenSpacing(cloud));
  const double thin = std::max(options.cell_thicknesses * SheetDistance(cloud, graph),
                               options.thin_cell_spacings * spacing);
  const double cell = std::max(std::min(thin, options.cell_spacings * spacing),
                               options.cell_noises * cloud.median_noise);
  return std::clamp(cell, smallest, 1.0 / kCoarsestCells);
}

}  // namespace

absl::Status ImplicitOptions::Validate() const {
  const auto check = [](const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat("implicit.", name, " = ", value, " must lie in [", low, ", ", high, "]"));
  };
  RILIEVO_RETURN_IF_ERROR(check("cell_spacings", cell_spacings, 0.25, 8));
  RILIEVO_RETURN_IF_ERROR(check("cell_thicknesses", cell_thicknesses, 1e-3, 1));
  RILIEVO_RETURN_IF_ERROR(check("thin_cell_spacings", thin_cell_spacings, 0.25, 8));
  RILIEVO_RETURN_IF_ERROR(check("reach_spacings", reach_spacings, 1, 1e6));
  RILIEVO_RETURN_IF_ERROR(check("cell_noises", cell_noises, 0, 16));
  RILIEVO_RETURN_IF_ERROR(check("screening", screening, 0, 100));
  return check("band_cells", band_cells, 2, 8);
}

absl::StatusOr<ImplicitFunction> FitImplicitFunction(const OrientedCloud& cloud,
                                                     const NeighborGraph& graph,
                                                     const ImplicitOptions& options,
                                                     const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (cloud.points.cols() == 0) return absl::InvalidArgumentError("the cloud holds no points");
  const double finest_cell = FinestCell(cloud, graph, options);
  const int level_count =
      std::clamp(1 + static_cast<int>(std::lround(std::log2(1.0 / (kCoarsestCells * finest_cell)))),
                 1, kMaxLevels);
  const double coarsest_cell = finest_cell * (1 << (level_count - 1));
  const Eigen::Vector3d origin = cloud.points.rowwise().minCoeff();

  Eigen::Matrix3Xd normals = SureNormals(cloud);
  GridLevel level = CoarsestLevel(cloud, origin, coarsest_cell);
  for (int depth = 0;; ++depth) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const Speakers speakers = SpeakersFor(cloud, level.cell, depth == 0);
    ScreenedPoisson system{.cloud = cloud,
                           .normals = normals,
                           .speakers = speakers,
                           .grid = level.grid,
                           .origin = origin,
                           .cell = level.cell,
                           .screening = options.screening,
                           .border_free = depth == 0 && !options.closed,
                           .iterations = depth == 0 ? 80 : 24};
    RILIEVO_RETURN_IF_ERROR(SolveScreenedPoisson(system, context, &level.values));
    for (int round = 0; depth + 1 == level_count && round < kTurningRounds; ++round) {
      RILIEVO_ASSIGN_OR_RETURN(const int64_t turned,
                               TurnOutvotedNormals(cloud, level, origin, context, &normals));
      if (static_cast<double>(turned) < kFewTurned * static_cast<double>(normals.cols())) break;
      RILIEVO_RETURN_IF_ERROR(SolveScreenedPoisson(system, context, &level.values));
    }
    context.Report(Stage::kControlMesh, 0.4 * (depth + 1) / level_count);
    if (depth + 1 == level_count) break;
    ImplicitGrid candidates;
    AddBandAroundPoints(cloud, SpeakersFor(cloud, level.cell / 2, false).points, origin,
                        level.cell / 2, options.band_cells, &candidates);
    if (!options.closed) {
      const ImplicitGrid reach = NodesInReach(cloud, origin, level.cell, options.reach_spacings);
      AddBandAroundZeroSet(level, &reach, &candidates);
    } else {
      AddBandAroundZeroSet(level, nullptr, &candidates);
    }
    RILIEVO_ASSIGN_OR_RETURN(level, RefineLevel(level, std::move(candidates), context));
  }
  return ImplicitFunction{.grid = std::move(level.grid),
                          .values = std::move(level.values),
                          .origin = origin,
                          .cell = level.cell,
                          .normals = std::move(normals)};
}

}  // namespace rilievo
