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

ScanSurface WholeOf(const BlockCase& block) {
  ScannerOptions scanner;
  scanner.points = 40000;
  scanner.views = 0;
  scanner.noise = block.noise;
  const ShapePtr shape = MakeShape(block.shape).value();
  CheckedScan checked = CheckScan(SimulateScan(*shape, scanner)->cloud, {}, {}).value();
  return AnalyzeScan(std::move(checked), {}, {}).value();
}

// How much the points of the block itself, a slab through the middle, differ from those of the
// whole.
struct Differences {
  double points = 0;
  double turned = 0;         // share of normals by more than a fiftieth of a radian
  double turned_far = 0;     // by more than a tenth
  double other_spacing = 0;  // share of spacings by more than a hundredth
  double noise = 0;  // of the block's, over that of the whole; 1 where there is next to none
};

Differences Compare(const ScanSurface& whole) {
  constexpr double kHalfWidth = 0.1;
  const OrientedCloud& cloud = whole.cloud;
  const double halo = kPageRuns.part_halo * cloud.median_spacing;
  std::vector<int> columns;
  for (int p = 0; p < cloud.points.cols(); ++p) {
    if (std::abs(cloud.points(0, p)) < kHalfWidth + halo) columns.push_back(p);
  }
  const AnalyzedBlock block = AnalyzeBlock(cloud.points(Eigen::all, columns), cloud.points.cols(),
                                           whole, ReconstructOptions(), RunContext())
                                  .value();
  Differences found;
  double own_noise = 0, noise_of_whole = 0;
  for (Eigen::Index i = 0; i < block.cloud.points.cols(); ++i) {
    const int p = columns[block.source[i]];
    if (std::abs(cloud.points(0, p)) >= kHalfWidth) continue;
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

class CleanBlockTest : public ::testing::TestWithParam<BlockCase> {};
INSTANTIATE_TEST_SUITE_P(Shapes, CleanBlockTest,
                         ::testing::Values(BlockCase{"torus", 0}, BlockCase{"bracket", 0},
                                           BlockCase{"terrain", 0}, BlockCase{"thinwalls", 0}));

TEST_P(CleanBlockTest, IsAnalyzedAsTheWhole) {
  const Differences found = Compare(WholeOf(GetParam()));
  EXPECT_GT(found.points, 5000);
  EXPECT_EQ(found.turned, 0);
  EXPECT_LT(found.other_spacing, 0.001);
  EXPECT_NEAR(found.noise, 1, 0.01);
}

// Noise is told by stretches of the Morton curve of so many points each. Those of a block begin
// elsewhere, and what is told of their noise differs as much as chance makes it.
class NoisyBlockTest : public ::testing::TestWithParam<BlockCase> {};
INSTANTIATE_TEST_SUITE_P(Shapes, NoisyBlockTest,
                         ::testing::Values(BlockCase{"torus", 0.001}, BlockCase{"torus", 0.003},
                                           BlockCase{"bracket", 0.001}, BlockCase{"bracket", 0.003},
                                           BlockCase{"terrain", 0.001},
                                           BlockCase{"thinwalls", 0.001}));

TEST_P(NoisyBlockTest, IsAnalyzedNearlyAsTheWhole) {
  const Differences found = Compare(WholeOf(GetParam()));
  EXPECT_GT(found.points, 5000);
  EXPECT_LT(found.turned, 0.1);
  EXPECT_LT(found.turned_far, 0.02);
  EXPECT_LT(found.other_spacing, 0.02);
  EXPECT_NEAR(found.noise, 1, 0.01);
}

}  // namespace
}  // namespace rilievo
