#include "core/scan/outliers.h"

#include <gtest/gtest.h>

#include "core/scan/check_scan.h"
#include "core/scan/scan_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

struct Found {
  double false_points_found = 0;   // share of the false points far from the shape that went
  double surface_points_lost = 0;  // share of the true points that went
};

Found Search(const AnalyticShape& shape, const SimulatedScan& scan) {
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
    } else if (std::abs(shape.Distance(scan.cloud.points.col(source))) > 0.02 * shape.diagonal()) {
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
