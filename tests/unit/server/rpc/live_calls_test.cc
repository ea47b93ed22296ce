#include "server/rpc/live_calls.h"

#include <gtest/gtest.h>

#include <atomic>

namespace rilievo {
namespace {

class CountingCall : public LiveCall {
 public:
  explicit CountingCall(LiveCalls* calls) : calls_(calls) {}
  ~CountingCall() override { calls_->Leave(this); }
  void Tick(Clock::time_point) override { ++ticks; }
  void Stop(StopReason reason) override { stopped = reason; }

  std::atomic<int> ticks{0};
  std::atomic<StopReason> stopped{StopReason::kNone};

 private:
  LiveCalls* calls_;
};

TEST(LiveCalls, TicksEveryCallSeveralTimesASecond) {
  LiveCalls calls;
  const auto first = std::make_shared<CountingCall>(&calls);
  const auto second = std::make_shared<CountingCall>(&calls);
  calls.Enter(first);
  calls.Enter(second);
  EXPECT_EQ(calls.size(), 2);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  while ((first->ticks < 3 || second->ticks < 3) && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_GE(first->ticks, 3);
  EXPECT_GE(second->ticks, 3);
}

TEST(LiveCalls, CountsThoseOfEachClient) {
  LiveCalls calls;
  auto first = std::make_shared<CountingCall>(&calls),
       second = std::make_shared<CountingCall>(&calls);
  const auto other = std::make_shared<CountingCall>(&calls);
  calls.Enter(first, "a");
  calls.Enter(second, "a");
  calls.Enter(other, "b");
  EXPECT_EQ(calls.size("a"), 2);
  EXPECT_EQ(calls.size("b"), 1);
  EXPECT_EQ(calls.size("c"), 0);
  first.reset();
  EXPECT_EQ(calls.size("a"), 1);
  second.reset();
  EXPECT_EQ(calls.size("a"), 0);
  EXPECT_EQ(calls.size(), 1);
}

TEST(LiveCalls, StopsAllWithTheReason) {
  LiveCalls calls;
  const auto call = std::make_shared<CountingCall>(&calls);
  calls.Enter(call);
  calls.StopAll(StopReason::kShutdown);
  EXPECT_EQ(call->stopped, StopReason::kShutdown);
}

TEST(LiveCalls, KeepsNoCallAliveAndSeesItLeave) {
  LiveCalls calls;
  auto call = std::make_shared<CountingCall>(&calls);
  calls.Enter(call);
  EXPECT_FALSE(calls.WaitUntilEmpty(std::chrono::milliseconds(1)));
  std::jthread leaver([&call] {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
    call.reset();
  });
  EXPECT_TRUE(calls.WaitUntilEmpty(std::chrono::seconds(5)));
  EXPECT_EQ(calls.size(), 0);
}

}  // namespace
}  // namespace rilievo
