#include "core/paging/scan_pager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <limits>
#include <set>

#include "core/geometry/point_cloud.h"
#include "core/scan/clean/check_scan.h"
#include "tests/unit/paging/scratch_damage.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// A sphere far from the origin, as on a map's grid.
Eigen::Matrix3Xd FarSphere(int points) {
  Eigen::Matrix3Xd sphere = SphereCloud(points, 3).cloud.points;
  sphere.colwise() += Eigen::Vector3d(4e5, 5e6, 120);
  return sphere;
}

PagedScan Paged(const Eigen::Matrix3Xd& points, int64_t run_points, Eigen::Index block = 700) {
  auto pager = ScanPager::Create(::testing::TempDir(), run_points);
  EXPECT_TRUE(pager.ok()) << pager.status();
  for (Eigen::Index i = 0; i < points.cols(); i += block) {
    EXPECT_TRUE(pager->Add(points.middleCols(i, std::min(block, points.cols() - i))).ok());
  }
  auto scan = pager->Finish(RunContext{});
  EXPECT_TRUE(scan.ok()) << scan.status();
  return *std::move(scan);
}

Eigen::Matrix3Xd AllPoints(const PagedScan& scan) {
  Eigen::Matrix3Xd points(3, scan.size());
  for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
    const auto of_page = scan.Read(page);
    EXPECT_TRUE(of_page.ok()) << of_page.status();
    points.middleCols(int64_t{page} * kPagePoints, of_page->cols()) = *of_page;
  }
  return points;
}

TEST(ScanPager, PutsPointsInTheOrderOfTheCheckedScan) {
  PointCloud cloud{FarSphere(20000)};
  const PagedScan paged = Paged(cloud.points, 1500);
  const auto checked = CheckScan(cloud, CheckOptions{}, RunContext{});
  ASSERT_TRUE(checked.ok());
  ASSERT_EQ(paged.size(), checked->points.cols());
  Eigen::Matrix3Xd expected(3, paged.size());
  for (Eigen::Index i = 0; i < expected.cols(); ++i) {
    expected.col(i) = cloud.points.col(checked->source_index[i]);
  }
  EXPECT_EQ(AllPoints(paged), expected);
  EXPECT_EQ(paged.curve().diagonal, checked->frame.diagonal);
}

TEST(ScanPager, DoesNotDependOnRunsBlocksOrTheOrderOfThePoints) {
  const Eigen::Matrix3Xd points = FarSphere(9000);
  const Eigen::Matrix3Xd expected = AllPoints(Paged(points, 1 << 20));
  EXPECT_EQ(AllPoints(Paged(points, 100, 33)), expected);
  EXPECT_EQ(AllPoints(Paged(points.rowwise().reverse(), 4000)), expected);
}

TEST(ScanPager, DropsWhatIsNotFiniteStraysAndDuplicates) {
  Eigen::Matrix3Xd points(3, 5005);
  points.leftCols(5000) = FarSphere(5000);
  points.col(5000) = points.col(17);
  points.col(5001) = points.col(4000);
  points.col(5002) << std::numeric_limits<double>::quiet_NaN(), 0, 0;
  points.col(5003) << 0, std::numeric_limits<double>::infinity(), 0;
  points.col(5004) << 1e30, 0, 0;
  const PagedScan paged = Paged(points, 1000);
  EXPECT_EQ(paged.size(), 5000);
  EXPECT_EQ(paged.figures().points_in, 5005);
  EXPECT_EQ(paged.figures().duplicates, 2);
  EXPECT_EQ(paged.figures().non_finite, 2);
  EXPECT_EQ(paged.figures().strays, 1);
  EXPECT_LT(paged.curve().diagonal, 4);
}

TEST(ScanPager, RefusesTooFewPoints) {
  auto pager = ScanPager::Create(::testing::TempDir());
  ASSERT_TRUE(pager.ok());
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Constant(3, 40, 2.0);
  points.col(3) << 1, 2, 3;
  ASSERT_TRUE(pager->Add(points).ok());
  const auto scan = pager->Finish(RunContext{});
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(scan.status().message(), ::testing::HasSubstr("2 distinct finite points"));
}

TEST(ScanPager, NamesAFolderThatIsNotThere) {
  const auto pager = ScanPager::Create(std::string("/no/such/folder"));
  EXPECT_EQ(pager.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(pager.status().message(), ::testing::HasSubstr("/no/such/folder"));
}

TEST(PagedScan, StretchesHoldThePointsOfTheirPageClosely) {
  const PagedScan paged = Paged(FarSphere(30000), 30000);
  for (int number = 0; number < static_cast<int>(paged.pages().size()); ++number) {
    const Page& page = paged.pages()[number];
    const Eigen::Matrix3Xd points = paged.Read(number).value();
    ASSERT_LE(page.stretches.size(), size_t{kStretchesOfPage});
    Eigen::Index first = 0;
    for (const PageStretch& stretch : page.stretches) {
      ASSERT_GT(stretch.points, 0);
      const auto columns = points.middleCols(first, stretch.points);
      EXPECT_EQ(stretch.box.min(), columns.rowwise().minCoeff());
      EXPECT_EQ(stretch.box.max(), columns.rowwise().maxCoeff());
      EXPECT_LT(stretch.box.diagonal().norm(), 0.5 * page.box.diagonal().norm());
      first += stretch.points;
    }
    EXPECT_EQ(first, points.cols());
  }
}

TEST(PageStretches, PointsOfOneCellAreOne) {
  const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, 5);
  const std::vector<uint64_t> one_cell(5, 77), two_cells = {76, 76, 77, 77, 77};
  ASSERT_EQ(CutStretches(points, one_cell).size(), 1u);
  EXPECT_EQ(CutStretches(points, one_cell)[0].points, 5);
  ASSERT_EQ(CutStretches(points, two_cells).size(), 2u);
  EXPECT_EQ(CutStretches(points, two_cells)[0].points, 2);
}

TEST(PagedScan, FindsThePointsOfABox) {
  const Eigen::Matrix3Xd points = FarSphere(30000);
  const PagedScan paged = Paged(points, 8000);
  const Eigen::Vector3d low = points.col(0).array() - 0.2, high = points.col(0).array() + 0.3;
  const Eigen::AlignedBox3d box(low, high);
  const auto found = paged.PointsIn(box, RunContext{});
  ASSERT_TRUE(found.ok());
  int64_t expected = 0;
  for (const auto point : points.colwise()) expected += box.contains(point);
  EXPECT_EQ(found->cols(), expected);
  EXPECT_GT(expected, 100);
  for (const auto point : found->colwise()) EXPECT_TRUE(box.contains(point));
  const auto none = paged.PointsIn(Eigen::AlignedBox3d(high, low), RunContext{});
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none->cols(), 0);
}

// On a smooth surface with even points many cells are cut by the same limit, or none of them.
TEST(PagedScan, ThinsToAtMostSoManyOfItsPoints) {
  const PagedScan paged = Paged(FarSphere(30000), 8000);
  const Eigen::Matrix3Xd all = AllPoints(paged);
  for (const int64_t most : {3000, 12000}) {
    const Eigen::Matrix3Xd thinned = paged.Thinned(most, {}, RunContext{}).value();
    EXPECT_LE(thinned.cols(), most);
    EXPECT_GT(static_cast<double>(thinned.cols()), 0.7 * static_cast<double>(most));
    Eigen::Index found = 0;
    for (Eigen::Index i = 0; i < all.cols() && found < thinned.cols(); ++i) {
      found += all.col(i) == thinned.col(found) ? 1 : 0;
    }
    EXPECT_EQ(found, thinned.cols()) << "not of the points, or not in their order";
  }
}

TEST(PagedScan, LeavesPointsOutOfTheThinned) {
  const PagedScan paged = Paged(FarSphere(20000), 8000);
  std::vector<bool> left_out(20000);
  for (size_t i = 0; i < left_out.size(); ++i) left_out[i] = i % 2 == 1;
  std::set<double> even;
  const Eigen::Matrix3Xd all = AllPoints(paged);
  for (Eigen::Index i = 0; i < all.cols(); i += 2) even.insert(all(0, i));
  const Eigen::Matrix3Xd thinned = paged.Thinned(3000, left_out, RunContext{}).value();
  EXPECT_GT(thinned.cols(), 2000);
  for (const auto point : thinned.colwise()) EXPECT_EQ(even.count(point.x()), 1u);
}

TEST(PagedScan, SamplesEachPartOfTheCurveAlike) {
  const PagedScan paged = Paged(FarSphere(20000), 8000);
  std::vector<bool> left_out(20000);
  for (size_t i = 5000; i < 10000; ++i) left_out[i] = true;
  const Eigen::Matrix3Xd all = AllPoints(paged);
  const Eigen::Matrix3Xd sampled = paged.Sampled(4000, left_out, RunContext{}).value();
  ASSERT_EQ(sampled.cols(), 4000);
  int begin = 0, end = 0, gone = 0;  // of quarters of the curve
  Eigen::Index found = 0;
  for (Eigen::Index i = 0; i < all.cols() && found < sampled.cols(); ++i) {
    if (all.col(i) != sampled.col(found)) continue;
    ++found;
    begin += i < 5000;
    gone += left_out[i];
    end += i >= 15000;
  }
  EXPECT_EQ(found, sampled.cols()) << "not of the points, or not in their order";
  EXPECT_EQ(gone, 0);
  EXPECT_NEAR(begin, 4000 / 3, 1);
  EXPECT_NEAR(end, 4000 / 3, 1);
  EXPECT_EQ(paged.Sampled(30000, left_out, RunContext{})->cols(), 15000);
}

TEST(PagedScan, KeepsAllPointsThatAreFewEnough) {
  const PagedScan paged = Paged(FarSphere(5000), 2000);
  const auto thinned = paged.Thinned(5000, {}, RunContext{});
  ASSERT_TRUE(thinned.ok());
  EXPECT_EQ(*thinned, AllPoints(paged));
}

TEST(PagedScan, NamesADamagedPage) {
  const PagedScan paged = Paged(FarSphere(20000), 8000);
  ASSERT_TRUE(DamageScratchFile(int64_t{2} * kPagePoints * 24 + 5));
  EXPECT_TRUE(paged.Read(1).ok());
  const absl::Status status = paged.Thinned(1000, {}, RunContext{}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), ::testing::HasSubstr("page 2 of 5 of the scan is damaged"));
}

TEST(ScanPager, RefusesBeforehandWhatHasNoRoom) {
  ScanPager pager = ScanPager::Create(::testing::TempDir()).value();
  EXPECT_TRUE(pager.Expect(1000).ok());
  const absl::Status status = pager.Expect(100'000'000'000'000);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), ::testing::HasSubstr("6000000000.1 MB more are needed"));
  EXPECT_THAT(status.message(), ::testing::HasSubstr(::testing::TempDir()));
}

// A limit of the size of files stands for a disk that is full.
TEST(ScanPager, SaysWhenThereIsNoRoom) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 100000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  ScanPager pager = ScanPager::Create(::testing::TempDir(), 1000).value();
  const absl::Status status = pager.Add(FarSphere(20000));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(status.message(), ::testing::HasSubstr(::testing::TempDir()));
}

}  // namespace
}  // namespace rilievo
