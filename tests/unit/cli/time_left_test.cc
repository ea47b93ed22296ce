#include "client/cli/time_left.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

constexpr int64_t kScan = 10'000'000, kThinned = 3'000'000;

// All stages in order, each reported so often.
template <typename Visit>
void GoThrough(int reports, const Visit& visit) {
  const v1::Stage stages[] = {v1::STAGE_CHECK,        v1::STAGE_NEIGHBORS,  v1::STAGE_NORMALS,
                              v1::STAGE_CONTROL_MESH, v1::STAGE_DOMAIN_FIT, v1::STAGE_DISPLACEMENT,
                              v1::STAGE_DISPLACEMENT, v1::STAGE_MEASURE,    v1::STAGE_ENCODE,
                              v1::STAGE_MEASURE};
  for (const v1::Stage stage : stages) {
    for (int i = 0; i <= reports; ++i) visit(stage, static_cast<double>(i) / reports);
  }
}

TEST(TimeLeftTest, FallsToNothing) {
  TimeLeft left(kScan, kThinned);
  double seconds = 0;
  std::optional<double> last;
  GoThrough(4, [&](v1::Stage stage, double fraction) {
    seconds += 10;
    const std::optional<double> now = left.After(stage, fraction, seconds);
    if (now) last = now;
  });
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(*last, 0);
}

TEST(TimeLeftTest, WhatAnEarlierRunHasDoneTellsNothingOfTheSpeed) {
  TimeLeft resumed(kScan, kThinned);
  resumed.After(v1::STAGE_DISPLACEMENT, 0.5, 1);
  const std::optional<double> told = resumed.After(v1::STAGE_DISPLACEMENT, 0.75, 101);
  ASSERT_TRUE(told.has_value());
  EXPECT_GT(*told, 95) << "a quarter took a hundred seconds, and so does the last";
}

TEST(TimeLeftTest, IsToldInTheUnitThatSuits) {
  EXPECT_EQ(TimeLeftText(0.2), "about 1 s left");
  EXPECT_EQ(TimeLeftText(42), "about 42 s left");
  EXPECT_EQ(TimeLeftText(200), "about 3 min left");
  EXPECT_EQ(TimeLeftText(7000), "about 2 h left");
}

}  // namespace
}  // namespace rilievo
