#include "core/base/run_context.h"

#include <gtest/gtest.h>

#include <set>
#include <stop_token>
#include <string>
#include <vector>

namespace rilievo {
namespace {

TEST(RunContextTest, StopTurnsStatusToCancelled) {
  std::stop_source source;
  RunContext context;
  EXPECT_TRUE(context.CheckStop().ok());
  context.stop = source.get_token();
  EXPECT_TRUE(context.CheckStop().ok());
  source.request_stop();
  EXPECT_EQ(context.CheckStop().code(), absl::StatusCode::kCancelled);
}

TEST(RunContextTest, ReportsClampedFractions) {
  std::vector<Progress> seen;
  RunContext context;
  context.Report(Stage::kCheck, 0.5);  // no sink: nothing to call
  context.progress = [&](const Progress& progress) { seen.push_back(progress); };
  context.Report(Stage::kDomainFit, -1);
  context.Report(Stage::kDomainFit, 0.25);
  context.Report(Stage::kEncode, 7);
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_EQ(seen[0].fraction, 0.0);
  EXPECT_EQ(seen[1].fraction, 0.25);
  EXPECT_EQ(seen[1].stage, Stage::kDomainFit);
  EXPECT_EQ(seen[2].fraction, 1.0);
}

TEST(RunContextTest, ThreadCountIsAskedForOrAllOfTheMachine) {
  RunContext context;
  EXPECT_GE(context.ThreadCount(), 1);
  context.threads = 3;
  EXPECT_EQ(context.ThreadCount(), 3);
}

TEST(RunContextTest, EachStageHasItsOwnName) {
  std::set<std::string> names;
  for (int i = 0; i < kStageCount; ++i) names.insert(StageName(static_cast<Stage>(i)));
  EXPECT_EQ(names.size(), static_cast<size_t>(kStageCount));
  EXPECT_EQ(names.count("unknown"), 0u);
  EXPECT_EQ(names.count("control-mesh"), 1u);
}

}  // namespace
}  // namespace rilievo
