// A block of a scan, with its halo, beside the whole scan.
#include "core/pipeline/analyze_block.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/pipeline/settings.h"
#include "core/scan/clean/check_scan.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

struct BlockCase {
  std::string shape;
  double noise;  // of the diagonal
};

void PrintTo(const BlockCase& block, std::ostream* out) { *out << block.shape << block.noise; }

struct WholeScan {
  SpatialFrame curve;  // in the unit frame of the scan
  ScanSurface scan;
};

WholeScan WholeOf(const BlockCase& block) {
  ScannerOptions scanner;
  scanner.points = 40000;
  scanner.views = 0;
  scanner.noise = block.noise;
  const ShapePtr shape = MakeShape(block.shape).value();
  CheckedScan checked = CheckScan(SimulateScan(*shape, scanner)->cloud, {}, {}).value();
  const SpatialFrame curve = checked.curve;
  ScanSurface scan = AnalyzeScan(std::move(checked), {}, {}).value();
  return {Between(curve, scan.frame), std::move(scan)};
}

// A block: what lies between two values of x; unit frame of the curve. The first is of whole cells,
// and only its halo cuts some.
struct Slab {
  double low, high;
};
constexpr Slab kWholeCells = {-0.25, 0}, kCutCells = {-0.1, 0.1};

// How much the points of a slab differ from those of the whole.
struct Differences {
  double points = 0;
  double turned = 0;         // share of normals by more than a fiftieth of a radian
  double turned_far = 0;     // by more than a tenth
  double other_spacing = 0;  // share of spacings by more than a hundredth
  double noise = 0;  // of the block's, over that of the whole; 1 where there is next to none
};

Differences Compare(const WholeScan& whole, const Slab& slab) {
  const OrientedCloud& cloud = whole.scan.cloud;
  const double halo = kPageRuns.part_halo * cloud.median_spacing;
  const double low = whole.curve.ScanFromUnit({slab.low, 0, 0}).x();
  const double high = whole.curve.ScanFromUnit({slab.high, 0, 0}).x();
  std::vector<int> columns;
  for (int p = 0; p < cloud.points.cols(); ++p) {
    const double x = cloud.points(0, p);
    if (x > low - halo && x < high + halo) columns.push_back(p);
  }
  const AnalyzedBlock block =
      AnalyzeBlock(cloud.points(Eigen::all, columns), cloud.points.cols(), whole.curve, whole.scan,
                   ReconstructOptions(), RunContext())
          .value();
  Differences found;
  double own_noise = 0, noise_of_whole = 0;
  for (Eigen::Index i = 0; i < block.cloud.points.cols(); ++i) {
    const int p = columns[block.source[i]];
    if (cloud.points(0, p) < low || cloud.points(0, p) >= high) continue;
    const double cosine = block.cloud.normals.col(i).dot(cloud.normals.col(p));
    found.points += 1;
    found.turned += cosine < std::cos(0.02) ? 1 : 0;
    found.turned_far += cosine < std::cos(0.1) ? 1 : 0;
    found.other_spacing +=
        std::abs(block.cloud.spacing[i] - cloud.spacing[p]) > 0.01 * cloud.spacing[p] ? 1 : 0;
    own_noise += block.cloud.noise[i] + 0.02 * cloud.spacing[p];
    noise_of_whole += cloud.noise[p] + 0.02 * cloud.spacing[p];
  }
  for (double* share : {&found.turned, &found.turned_far, &found.other_spacing}) {
    *share /= found.points;
  }
  found.noise = own_noise / noise_of_whole;
  return found;
}

class BlockTest : public ::testing::TestWithParam<BlockCase> {};
INSTANTIATE_TEST_SUITE_P(Shapes, BlockTest,
                         ::testing::Values(BlockCase{"torus", 0}, BlockCase{"bracket", 0},
                                           BlockCase{"terrain", 0}, BlockCase{"thinwalls", 0},
                                           BlockCase{"torus", 0.001}, BlockCase{"torus", 0.003},
                                           BlockCase{"bracket", 0.001}, BlockCase{"bracket", 0.003},
                                           BlockCase{"terrain", 0.001},
                                           BlockCase{"thinwalls", 0.001}));

TEST_P(BlockTest, IsAnalyzedAsTheWhole) {
  const WholeScan whole = WholeOf(GetParam());
  const bool clean = GetParam().noise == 0;
  const Differences cells = Compare(whole, kWholeCells);
  EXPECT_GT(cells.points, 5000);
  EXPECT_LE(cells.turned, clean ? 0 : 0.0005);
  EXPECT_EQ(cells.turned_far, 0);
  EXPECT_LT(cells.other_spacing, 0.001);
  EXPECT_NEAR(cells.noise, 1, 0.01);
  // Where the border cuts cells of the curve, stretches are shorter and tell another noise.
  const Differences cut = Compare(whole, kCutCells);
  EXPECT_GT(cut.points, 5000);
  EXPECT_LE(cut.turned, clean ? 0 : 0.01);
  EXPECT_LE(cut.turned_far, clean ? 0 : 0.004);
  EXPECT_LT(cut.other_spacing, 0.001);
  EXPECT_NEAR(cut.noise, 1, 0.01);
}

}  // namespace
}  // namespace rilievo
