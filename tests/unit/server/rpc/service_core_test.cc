#include "server/rpc/service_core.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grpcpp/server_context.h"

namespace rilievo {
namespace {

class Standing final : public LiveCall {
 public:
  void Tick(Clock::time_point) override {}
  void Stop(StopReason) override {}
};

TEST(ServiceCore, StreamsAreBoundedAllTogether) {
  ServerOptions options;
  options.max_calls = 2;
  ServiceCore core(options, {}, {}, std::make_unique<Doorkeeper>());
  grpc::CallbackServerContext context;
  Caller caller;
  const auto first = std::make_shared<Standing>(), second = std::make_shared<Standing>();
  core.live_calls.Enter(first, "other");
  EXPECT_FALSE(core.AdmitStream(context, &caller).has_value());
  core.live_calls.Enter(second, "other");
  const auto error = core.AdmitStream(context, &caller);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(error->reason, ErrorCause::kCallsLimit);
  EXPECT_TRUE(error->retry_delay.has_value());
  core.live_calls.Leave(second.get());
  EXPECT_FALSE(core.AdmitStream(context, &caller).has_value());
  core.live_calls.Leave(first.get());
}

TEST(ServiceCore, OneClientLeavesStreamsToOthers) {
  ServerOptions options;
  options.max_calls = 4;
  ServiceCore core(options, {}, {}, std::make_unique<Doorkeeper>());
  grpc::CallbackServerContext context;
  Caller caller;
  ASSERT_FALSE(core.AdmitStream(context, &caller).has_value());
  const auto first = std::make_shared<Standing>(), second = std::make_shared<Standing>();
  core.live_calls.Enter(first, caller.client);
  EXPECT_FALSE(core.AdmitStream(context, &caller).has_value());
  core.live_calls.Enter(second, caller.client);
  const auto error = core.AdmitStream(context, &caller);
  ASSERT_TRUE(error.has_value()) << "two are free, for others";
  EXPECT_EQ(error->reason, ErrorCause::kCallsLimit);
  EXPECT_THAT(error->message, testing::HasSubstr("2 are yours"));
  core.live_calls.Leave(second.get());
  core.live_calls.Leave(first.get());
}

TEST(ServiceCore, AnEndedJobIsLoggedAndCounted) {
  int logged = 0;
  const ServiceCore core(
      {}, {}, [&](const JobRecord&) { ++logged; }, std::make_unique<Doorkeeper>());
  core.Report({});
  EXPECT_EQ(logged, 1);
  EXPECT_THAT(core.metrics->Text(), testing::HasSubstr("rilievo_jobs_ended_total{"));
  EXPECT_THAT(core.metrics->Text(), Not(testing::HasSubstr("rilievo_attempts_ended_total{")));
  JobRecord attempt;
  attempt.id = "kept";
  core.Report(attempt);
  EXPECT_EQ(logged, 2);
  EXPECT_THAT(core.metrics->Text(), testing::HasSubstr("rilievo_attempts_ended_total{"));
}

}  // namespace
}  // namespace rilievo
