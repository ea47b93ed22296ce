#include "client/cli/region_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

TEST(RegionWordsTest, FacesRowsAndBoxes) {
  const auto region = ReadRegionWords({"17", "0-99", "box:1,-2,3.5,-1,2,1e1"});
  ASSERT_TRUE(region.ok()) << region.status();
  EXPECT_THAT(region->faces, ElementsAre(Pair(17, 17), Pair(0, 99)));
  ASSERT_EQ(region->boxes.size(), 1u);
  EXPECT_EQ(region->boxes[0].min(), Eigen::Vector3d(-1, -2, 3.5));
  EXPECT_EQ(region->boxes[0].max(), Eigen::Vector3d(1, 2, 10));
}

TEST(RegionWordsTest, OtherWordsAreNamed) {
  for (const char* word : {"", "a", "-1", "5-3", "1-", "1,2", "box:", "box:1,2,3",
                           "box:1,2,3,4,5,x", "box:1,2,3,4,5,nan", "99999999999"}) {
    const auto region = ReadRegionWords({"1", word});
    EXPECT_EQ(region.status().code(), absl::StatusCode::kInvalidArgument) << word;
    EXPECT_THAT(region.status().message(), HasSubstr(absl::StrCat("--region ", word, ":")));
  }
}

}  // namespace
}  // namespace rilievo
