#include "server/jobs/job_events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

v1::Job InState(v1::JobState state, uint32_t attempts) {
  v1::Job job;
  job.set_state(state);
  job.set_attempts(attempts);
  job.set_sequence(SequenceOfState(state, attempts));
  return job;
}

v1::Progress At(v1::Stage stage, double fraction) {
  v1::Progress progress;
  progress.set_stage(stage);
  progress.set_fraction(fraction);
  return progress;
}

std::vector<v1::JobEvent> All(const JobEvents& events, uint64_t after = 0) {
  std::vector<v1::JobEvent> all;
  while (const auto event = events.After(after)) {
    after = event->sequence();
    all.push_back(*event);
  }
  return all;
}

TEST(JobEvents, NumbersGrowOverStatesAttemptsAndRestarts) {
  uint64_t last = 0;
  for (const auto& [state, attempts] :
       std::vector<std::pair<v1::JobState, uint32_t>>{{v1::JOB_STATE_QUEUED, 0},
                                                      {v1::JOB_STATE_RUNNING, 1},
                                                      {v1::JOB_STATE_QUEUED, 1},
                                                      {v1::JOB_STATE_RUNNING, 2},
                                                      {v1::JOB_STATE_SUCCEEDED, 2}}) {
    EXPECT_GT(SequenceOfState(state, attempts), last);
    last = SequenceOfState(state, attempts);
  }
  EXPECT_GT(SequenceOfState(v1::JOB_STATE_CANCELLED, 0), SequenceOfState(v1::JOB_STATE_QUEUED, 0));
}

TEST(JobEvents, HoldsTheLatestOfEachStageHoweverManyCome) {
  JobEvents events(InState(v1::JOB_STATE_QUEUED, 0));
  events.Push(InState(v1::JOB_STATE_RUNNING, 1));
  for (int i = 0; i <= 1000; ++i) events.Push(At(v1::STAGE_CHECK, i / 1000.0));
  for (int i = 0; i <= 1000; ++i) events.Push(At(v1::STAGE_NORMALS, i / 1000.0));
  const auto all = All(events);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[2].progress().fraction(), 1);
  EXPECT_EQ(All(events, all[2].sequence()).size(), 1u);
  EXPECT_EQ(events.EndAfter(all[3].sequence()), std::nullopt);
}

TEST(JobEvents, ANewAttemptMakesOldProgressOutOfDate) {
  JobEvents events(InState(v1::JOB_STATE_RUNNING, 1));
  events.Push(At(v1::STAGE_CHECK, 0.5));
  events.Push(InState(v1::JOB_STATE_QUEUED, 1));
  events.Push(InState(v1::JOB_STATE_RUNNING, 2));
  const auto all = All(events);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].job().attempts(), 2u);
}

TEST(JobEvents, EndsWithAFinishedState) {
  JobEvents events(InState(v1::JOB_STATE_RUNNING, 1));
  events.Push(InState(v1::JOB_STATE_CANCELLED, 1));
  events.Push(At(v1::STAGE_CHECK, 1));
  events.Push(InState(v1::JOB_STATE_SUCCEEDED, 1));
  const auto all = All(events);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].job().state(), v1::JOB_STATE_CANCELLED);
  EXPECT_EQ(events.EndAfter(all[1].sequence()), absl::OkStatus());
  EXPECT_EQ(events.EndAfter(all[0].sequence()), std::nullopt);
  events.Close(absl::UnavailableError("late"));
  EXPECT_EQ(events.EndAfter(all[1].sequence()), absl::OkStatus());
}

TEST(JobEvents, WatchersAreToldUntilTheyLeave) {
  JobEvents events(InState(v1::JOB_STATE_QUEUED, 0));
  int told = 0;
  events.Watch(&told, [&] { ++told; });
  events.Push(At(v1::STAGE_CHECK, 1));
  EXPECT_EQ(told, 1);
  events.Close(absl::UnavailableError("the server stops"));
  EXPECT_EQ(told, 2);
  EXPECT_TRUE(absl::IsUnavailable(*events.EndAfter(0)));
  events.Unwatch(&told);
  events.Push(At(v1::STAGE_CHECK, 1));
  EXPECT_EQ(told, 2);
}

}  // namespace
}  // namespace rilievo
