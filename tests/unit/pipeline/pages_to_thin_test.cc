#include "core/pipeline/pages_to_thin.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "core/paging/scan_pager.h"
#include "tests/scans/scene.h"
#include "tests/scans/scene_scanner.h"

namespace rilievo {
namespace {

TEST(LeftOutOfPagesTest, LeavesAreAndTheGardenIsNot) {
  const SceneScan scan = ScanScene(MakeGarden(), {.points = 300000, .noise = 0.0002}).value();
  using Place = std::array<double, 3>;
  std::set<Place> leaves;
  for (Eigen::Index i = 0; i < scan.cloud.points.cols(); ++i) {
    const auto point = scan.cloud.points.col(i);
    if (scan.is_leaf[i] != 0) leaves.insert(Place{point.x(), point.y(), point.z()});
  }
  ScanPager pager = ScanPager::Create(::testing::TempDir(), 100000).value();
  ASSERT_TRUE(pager.Add(scan.cloud.points).ok());
  const PagedScan pages = pager.Finish(RunContext{}).value();
  ASSERT_GT(pages.pages().size(), 64) << "one run alone";
  const std::vector<bool> left_out =
      LeftOutOfPages(pages, ReconstructOptions{}, {[](double) {}}, RunContext{}).value();
  ASSERT_EQ(left_out.size(), static_cast<size_t>(pages.size()));
  int64_t index = 0, leaves_seen = 0, leaves_left = 0, others_gone = 0;
  for (int page = 0; page < static_cast<int>(pages.pages().size()); ++page) {
    for (const auto point : pages.Read(page)->colwise()) {
      const bool is_leaf = leaves.contains({point.x(), point.y(), point.z()});
      leaves_seen += is_leaf;
      leaves_left += is_leaf && !left_out[index];
      others_gone += !is_leaf && left_out[index];
      ++index;
    }
  }
  EXPECT_GT(leaves_seen, 15000);
  EXPECT_LT(leaves_left, 0.05 * leaves_seen);
  EXPECT_LT(others_gone, 0.02 * (pages.size() - leaves_seen));
}

}  // namespace
}  // namespace rilievo
