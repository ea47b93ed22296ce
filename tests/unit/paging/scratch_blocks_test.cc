// Blocks on disk, and the surfels of a scan in them.
#include "core/paging/scratch_blocks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "core/paging/scan_pager.h"
#include "core/paging/scratch_surfels.h"
#include "tests/unit/paging/scratch_damage.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

TEST(ScratchBlocks, HoldWhatWasWrittenLast) {
  ScratchBlocks blocks = ScratchBlocks::Create(::testing::TempDir(), "", 3, 8).value();
  ASSERT_TRUE(blocks.Write(2, std::vector<uint8_t>{1, 2, 3}).ok());
  ASSERT_TRUE(blocks.Write(0, std::vector<uint8_t>(8, 7)).ok());
  ASSERT_TRUE(blocks.Write(2, std::vector<uint8_t>{4, 5}).ok());
  EXPECT_EQ(blocks.Read(0).value(), std::vector<uint8_t>(8, 7));
  EXPECT_TRUE(blocks.Read(1)->empty());
  EXPECT_EQ(blocks.Read(2).value(), (std::vector<uint8_t>{4, 5}));
  blocks.Forget();
  EXPECT_TRUE(blocks.Read(2)->empty());
}

TEST(ScratchBlocks, NameADamagedOne) {
  ScratchBlocks blocks = ScratchBlocks::Create(::testing::TempDir(), "", 3, 8).value();
  ASSERT_TRUE(blocks.Write(1, std::vector<uint8_t>(8, 7)).ok());
  ASSERT_TRUE(DamageScratchFile(16 + 8 + 5));
  const absl::Status status = blocks.Read(1).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(status.message(), ::testing::HasSubstr("block 1 of 3"));
}

TEST(ScratchSurfels, AreKeptByPage) {
  ScanPager pager = ScanPager::Create(::testing::TempDir()).value();
  ASSERT_TRUE(pager.Add(SphereCloud(10000, 3).cloud.points).ok());
  const PagedScan scan = pager.Finish(RunContext{}).value();
  ScratchSurfels surfels = ScratchSurfels::Create(scan).value();
  for (const int page : {2, 0}) {
    std::vector<Surfel> of_page(static_cast<size_t>(PointsOfPage(page, scan.size())));
    for (size_t i = 0; i < of_page.size(); ++i) {
      of_page[i] = {{1, 0, 0}, static_cast<float>(page * kPagePoints + i), 0.5f};
    }
    ASSERT_TRUE(surfels.Write(page, of_page).ok());
  }
  int64_t of_surface = 0;
  for (int page = 0; page < 3; ++page) {
    const std::vector<Surfel> of_page = surfels.Read(page).value();
    EXPECT_EQ(static_cast<int64_t>(of_page.size()), PointsOfPage(page, scan.size()));
    for (size_t i = 0; i < of_page.size(); ++i) {
      if (!of_page[i].is_of_surface()) continue;
      EXPECT_EQ(of_page[i].spacing, static_cast<float>(page * kPagePoints + i));
      EXPECT_EQ(of_page[i].noise, 0.5f);
      ++of_surface;
    }
  }
  // Page 1 was never written, and the first spacing of page 0 is none.
  EXPECT_EQ(of_surface, kPagePoints - 1 + PointsOfPage(2, scan.size()));
}

}  // namespace
}  // namespace rilievo
