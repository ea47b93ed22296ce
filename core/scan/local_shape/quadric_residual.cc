#include "core/scan/local_shape/quadric_residual.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/points/height_field.h"
#include "core/points/neighbor_graph.h"
#include "core/points/settings.h"
#include "core/scan/local_shape/otsu_threshold.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

// Heights that fall into two groups with next to nothing between them are those of two sheets:
// their share of the squares that is left within the groups, else 1.
double ShareWithinSheets(std::span<double> heights) {
  const double within = OtsuThreshold(heights, kCommon.fewest_witnesses).within;
  return within < kQuadricResidual.two_sheets ? within : 1;
}

}  // namespace

double QuadricResidual(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors,
                       double radius, const Eigen::Vector3d& normal) {
  constexpr int kRows = HeightFieldRows(kNeighborGraph.most_neighbors + 1);
  neighbors = neighbors.first(std::min<size_t>(neighbors.size(), kNeighborGraph.most_neighbors));
  if (!(radius > 0) || neighbors.size() <= kQuadricTerms) return 0;
  const Eigen::Vector3d u = normal.unitOrthogonal() / radius;
  const Eigen::Vector3d v = normal.cross(u);
  std::array<double, kRows> x, y, z, weight;
  x[0] = y[0] = z[0] = 0;  // the centre itself
  int count = 1;
  for (const int j : neighbors) {
    const Eigen::Vector3d offset = points.col(j) - points.col(center);
    x[count] = u.dot(offset);
    y[count] = v.dot(offset);
    z[count++] = normal.dot(offset) / radius;
  }
  const int rows = HeightFieldRows(count);
  std::fill(weight.begin(), weight.begin() + count, 1.0);
  for (std::array<double, kRows>* values : {&x, &y, &z, &weight}) {
    std::fill(values->begin() + count, values->begin() + rows, 0.0);
  }
  const HeightFieldSums sums = SumHeights({x.data(), y.data(), z.data(), weight.data(), count});
  const Eigen::Matrix<double, 6, 1> fit = FitHeights<6>(sums, 1e-9);
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> right(sums.heights.data());
  double squares = std::max(0.0, sums.squares - fit.dot(right));
  if (squares > kQuadricResidual.flat * kQuadricResidual.flat * count) {
    for (int i = 0; i < count; ++i) {
      z[i] -= fit[0] + fit[1] * x[i] + fit[2] * y[i] + fit[3] * x[i] * x[i] + fit[4] * x[i] * y[i] +
              fit[5] * y[i] * y[i];
    }
    squares *= ShareWithinSheets(std::span(z.data(), static_cast<size_t>(count)));
  }
  return radius * std::sqrt(squares / (count - kQuadricTerms));
}

}  // namespace rilievo
