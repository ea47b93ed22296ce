#include "core/pipeline/page_runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/paging/scan_pager.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

constexpr int kPoints = 60'000;
constexpr double kHalo = 0.03;

PagedScan Sphere() {
  ScanPager pager = ScanPager::Create(::testing::TempDir()).value();
  EXPECT_TRUE(pager.Add(SphereCloud(kPoints, 3).cloud.points).ok());
  return pager.Finish(RunContext{}).value();
}

// Of the columns that lie in one of the run's pages.
double DistanceTo(const Eigen::Matrix3Xd& own, const Eigen::Vector3d& point) {
  return (own.colwise() - point).colwise().norm().minCoeff();
}

TEST(PageRunsTest, RunsFitIntoMemoryWithAllThatIsAround) {
  const PagedScan scan = Sphere();
  const PageRuns runs(scan, kHalo);
  constexpr int64_t kMost = 26'000;
  const std::vector<PageRun> cut = runs.Cut(kMost);
  EXPECT_GE(cut.size(), 4u);
  int next = 0;
  for (const PageRun& run : cut) {
    EXPECT_EQ(run.begin, next);
    next = run.end;
    EXPECT_LE(run.points, kMost);
    int64_t points = PointsOfRun(run, scan.size());
    Eigen::Matrix3Xd own(3, points);
    for (int page = run.begin; page < run.end; ++page) {
      const Eigen::Matrix3Xd of_page = scan.Read(page).value();
      own.middleCols(int64_t{page - run.begin} * kPagePoints, of_page.cols()) = of_page;
    }
    for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
      if (page >= run.begin && page < run.end) continue;
      const bool is_read = std::binary_search(run.read.begin(), run.read.end(), page);
      const Eigen::Matrix3Xd of_page = scan.Read(page).value();
      for (Eigen::Index i = 0; i < of_page.cols(); i += 61) {
        if (DistanceTo(own, of_page.col(i)) > kHalo) continue;
        EXPECT_TRUE(runs.IsAround(run, of_page.col(i)));
        EXPECT_TRUE(is_read);
      }
      for (const auto point : of_page.colwise()) points += is_read && runs.IsAround(run, point);
    }
    EXPECT_LE(points, run.points);
  }
  EXPECT_EQ(next, static_cast<int>(scan.pages().size()));
}

TEST(PageRunsTest, WhereHalvesReadAllTheyAreNotCut) {
  const PagedScan scan = Sphere();
  const std::vector<PageRun> cut = PageRuns(scan, 2).Cut(kPagePoints);
  ASSERT_EQ(cut.size(), 1u);
  EXPECT_EQ(cut[0].points, kPoints);
  EXPECT_EQ(cut[0].read.size(), scan.pages().size());
}

}  // namespace
}  // namespace rilievo
