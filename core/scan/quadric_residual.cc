#include "core/scan/quadric_residual.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/scan/height_split.h"
#include "core/scan/neighbor_graph.h"

namespace rilievo {
namespace {

// Heights that fall into two groups with next to nothing between them are those of two sheets:
// their share of the squares that is left within the groups, else 1.
double ShareWithinSheets(std::span<double> heights) {
  constexpr double kTwoSheets = 0.16;
  constexpr int kFewestOfSheet = 3;
  const double within = SplitHeights(heights, kFewestOfSheet).within;
  return within < kTwoSheets ? within : 1;
}

}  // namespace

double QuadricResidual(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors,
                       double radius, const Eigen::Vector3d& normal) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  constexpr int kUnknowns = 6;
  if (!(radius > 0) || neighbors.size() < kUnknowns + 1) return 0;
  const Eigen::Vector3d u = normal.unitOrthogonal() / radius;
  const Eigen::Vector3d v = normal.cross(u);
  Matrix6 gram = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double heights = 0;
  gram(0, 0) = 1;  // the centre itself
  constexpr size_t kMostRows = kMostNeighbors + 1;
  std::array<Vector6, kMostRows> rows;
  std::array<double, kMostRows> residuals;
  rows[0] << 1, 0, 0, 0, 0, 0;
  residuals[0] = 0;
  size_t kept = 1;
  for (const int j : neighbors) {
    const Eigen::Vector3d offset = points.col(j) - points.col(center);
    const double x = u.dot(offset), y = v.dot(offset), z = normal.dot(offset) / radius;
    Vector6 row;
    row << 1, x, y, x * x, x * y, y * y;
    gram.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += z * row;
    heights += z * z;
    if (kept == kMostRows) continue;
    rows[kept] = row;
    residuals[kept++] = z;
  }
  gram.diagonal().array() += 1e-9;  // neighbours on one line leave the quadric undetermined
  const Vector6 fit = gram.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  double squares = std::max(0.0, heights - fit.dot(right));
  constexpr double kFlat = 0.01;  // of the radius: no second sheet
  if (squares > kFlat * kFlat * static_cast<double>(kept)) {
    for (size_t i = 0; i < kept; ++i) residuals[i] -= fit.dot(rows[i]);
    squares *= ShareWithinSheets(std::span(residuals.data(), kept));
  }
  return radius * std::sqrt(squares / (static_cast<double>(neighbors.size()) + 1 - kUnknowns));
}

}  // namespace rilievo
