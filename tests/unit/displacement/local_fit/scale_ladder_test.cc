#include "core/displacement/local_fit/scale_ladder.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace rilievo {
namespace {

TEST(ScaleLadderTest, AnEmptyLadderSaysNothing) {
  EXPECT_FALSE(SelectScale(ScaleLadder()).has_value());
}

TEST(ScaleLadderTest, AWiderWindowIsBlendedInByHowWellItAgrees) {
  for (const float off : {0.0f, 0.05f, 0.15f}) {
    ScaleLadder ladder;
    ladder.noise = 0.1f;
    ladder.Add(1, {0.02f, 0, 0, 0.25f});
    ladder.Add(2, {0.02f + off, 0, 0, 0.1f});
    const float doubt = off * off / (0.1f * 0.1f * 6 * 0.25f);
    const float blend = std::max(0.0f, 1 - doubt);
    EXPECT_NEAR(SelectScale(ladder)->height, 0.02f + blend * off, 1e-6) << off;
    EXPECT_NEAR(SelectScale(ladder)->variance_factor, 0.25f - blend * 0.15f, 1e-6) << off;
  }
}

TEST(ScaleLadderTest, AWindowFarOffIsNotFollowed) {
  ScaleLadder ladder;
  ladder.noise = 0.1f;
  ladder.Add(0, {0.02f, 0, 0, 0.5f});
  ladder.Add(2, {1.0f, 0.3f, 0, 0.1f});
  EXPECT_TRUE(IsOut(ladder.windows[1], ladder.windows[0], ladder.noise));
  const auto fit = SelectScale(ladder);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->height, 0.02f);
  EXPECT_EQ(fit->variance_factor, 0.5f);
}

}  // namespace
}  // namespace rilievo
