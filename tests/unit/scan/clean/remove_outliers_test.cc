#include "core/scan/clean/remove_outliers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/scan/clean/check_scan.h"
#include "core/scan/scan_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/random.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

struct Found {
  double false_points_found = 0;   // share of those `far_off` diagonals from the shape that went
  double surface_points_lost = 0;  // share of the true points that went
};

Found Search(const AnalyticShape& shape, const SimulatedScan& scan, double far_off = 0.02) {
  const CheckedScan checked = CheckScan(scan.cloud, CheckOptions{}, RunContext{}).value();
  const PointIndex index(checked.points);
  const NeighborGraph graph =
      BuildNeighborGraph(index, checked.points, NeighborOptions{}, RunContext{}).value();
  const OutlierResult result =
      FindOutliers(checked.points, graph, OutlierOptions{}, RunContext{}).value();
  int far = 0, far_gone = 0, good = 0, good_gone = 0;
  for (size_t i = 0; i < checked.source_index.size(); ++i) {
    const int source = checked.source_index[i];
    if (scan.outlier[source] == 0) {
      ++good;
      good_gone += result.keep[i] == 0;
    } else if (std::abs(shape.Distance(scan.cloud.points.col(source))) >
               far_off * shape.diagonal()) {
      ++far;
      far_gone += result.keep[i] == 0;
    }
  }
  return {far == 0 ? 1.0 : static_cast<double>(far_gone) / far,
          static_cast<double>(good_gone) / good};
}

TEST(OutliersTest, FalsePointsGoAndTheSurfaceStays) {
  for (const char* name : {"torus", "genus2", "cutbox"}) {
    const ShapePtr shape = MakeShape(name).value();
    ScannerOptions options;
    options.points = 30000;
    options.outliers = 0.03;
    options.noise = 0.001;
    const Found found = Search(*shape, SimulateScan(*shape, options).value());
    EXPECT_GT(found.false_points_found, 0.93) << name;
    EXPECT_LT(found.surface_points_lost, 0.01) << name;
  }
}

// Along x a scan 33 times denser at one end than at the other, its noise as thick as the dense
// end's spacing.
SimulatedScan UnevenScan(const AnalyticShape& shape, double strays, uint64_t seed) {
  ScannerOptions options;
  options.points = 150000;
  options.views = 0;
  options.noise = 0.002;
  options.outliers = strays;
  options.seed = seed;
  const SimulatedScan even = SimulateScan(shape, options).value();
  const Eigen::RowVectorXd x = even.cloud.points.row(0);
  const double low = x.minCoeff(), high = x.maxCoeff();
  Random random(seed);
  std::vector<int> kept;
  for (int i = 0; i < x.size(); ++i) {
    const double share = (x[i] - low) / (high - low);
    if (even.outlier[i] != 0 || random.Uniform() < std::pow(33, share - 1)) kept.push_back(i);
  }
  SimulatedScan uneven;
  uneven.cloud.points.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (size_t i = 0; i < kept.size(); ++i) {
    uneven.cloud.points.col(static_cast<Eigen::Index>(i)) = even.cloud.points.col(kept[i]);
    uneven.outlier.push_back(even.outlier[kept[i]]);
  }
  return uneven;
}

// Strays beside the sparse end lie hardly farther apart than its points: a cloud of them must not
// vouch for itself.
TEST(OutliersTest, StraysBesideASparseEndGo) {
  // About 3 and 10 % of the points left, and the share to be found.
  const std::pair<double, double> clouds[] = {{0.008, 0.96}, {0.03, 0.95}};
  for (const char* name : {"genus2", "torus", "cutbox"}) {
    for (const auto& [strays, share] : clouds) {
      const ShapePtr shape = MakeShape(name).value();
      const Found found = Search(*shape, UnevenScan(*shape, strays, 7), 0.04);
      EXPECT_GT(found.false_points_found, share) << name << ' ' << strays;
      EXPECT_LT(found.surface_points_lost, 0.002) << name << ' ' << strays;
    }
  }
}

TEST(OutliersTest, AChangeOfDensityIsNoOutlier) {
  const ShapePtr sphere = MakeSphere();
  ScannerOptions options;
  options.points = 30000;
  options.views = 1;
  options.view_distance = 1.3;
  options.max_incidence_degrees = 85;
  const Found found = Search(*sphere, SimulateScan(*sphere, options).value());
  EXPECT_LT(found.surface_points_lost, 0.01);
}

TEST(OutliersTest, ASecondComponentStays) {
  const ShapePtr pair = MakePair();
  ScannerOptions options;
  options.points = 20000;
  options.views = 0;
  EXPECT_LT(Search(*pair, SimulateScan(*pair, options).value()).surface_points_lost, 0.002);
}

}  // namespace
}  // namespace rilievo
