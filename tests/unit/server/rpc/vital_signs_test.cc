#include "server/rpc/vital_signs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>

#include "server/rpc/job_pool.h"
#include "server/rpc/live_calls.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

template <typename Condition>
bool Comes(const Condition& condition) {
  const auto end = Heartbeat::Clock::now() + seconds(10);
  while (!condition()) {
    if (Heartbeat::Clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(1));
  }
  return true;
}

TEST(Heartbeat, IsSilentOnlyWithWork) {
  Heartbeat heart;
  const auto later = Heartbeat::Clock::now() + seconds(60);
  EXPECT_EQ(heart.SilentFor(later), seconds(0));
  heart.SetBusy(true);
  EXPECT_GT(heart.SilentFor(later), seconds(50));
  EXPECT_LT(heart.SilentFor(later), seconds(61)) << "the work has just come";
  heart.SetBusy(false);
  EXPECT_EQ(heart.SilentFor(later), seconds(0));
}

TEST(VitalSigns, TellsOfAHeartThatStopsAndOfOneThatBeatsAgain) {
  Heartbeat well, ill;
  well.SetBusy(false);
  std::atomic<int> calls = 0;
  std::atomic<bool> alive = true;
  const VitalSigns signs({{"well", &well}, {"ill", &ill}}, milliseconds(50), [&](bool now) {
    alive = now;
    ++calls;
  });
  ill.SetBusy(true);
  EXPECT_TRUE(Comes([&] { return !alive; }));
  ill.Beat();
  EXPECT_TRUE(Comes([&] { return alive.load(); }));
  EXPECT_GE(calls, 2);
}

// Its Tick() waits until it may go on.
class StuckCall final : public LiveCall {
 public:
  explicit StuckCall(std::shared_future<void> go_on) : go_on_(std::move(go_on)) {}
  void Tick(Clock::time_point) override { go_on_.wait(); }
  void Stop(StopReason) override {}

 private:
  const std::shared_future<void> go_on_;
};

TEST(VitalSigns, SeeATickerThatIsStuck) {
  std::promise<void> go_on;
  LiveCalls calls;
  std::this_thread::sleep_for(milliseconds(300));
  EXPECT_LT(calls.heart().SilentFor(Heartbeat::Clock::now()), milliseconds(250)) << "idle";
  const auto call = std::make_shared<StuckCall>(go_on.get_future().share());
  calls.Enter(call);
  EXPECT_TRUE(
      Comes([&] { return calls.heart().SilentFor(Heartbeat::Clock::now()) > milliseconds(300); }));
  go_on.set_value();
  EXPECT_TRUE(
      Comes([&] { return calls.heart().SilentFor(Heartbeat::Clock::now()) < milliseconds(200); }));
  calls.Leave(call.get());
}

TEST(VitalSigns, APoolAtWorkIsWell) {
  const auto later = [] { return Heartbeat::Clock::now() + seconds(60); };
  std::promise<void> go_on;
  const std::shared_future<void> may_go_on = go_on.get_future().share();
  JobPool pool(2, 4, /*memory=*/100);
  EXPECT_EQ(pool.heart().SilentFor(later()), seconds(0)) << "nothing to do";
  // The second thread is free, but there is no memory for the other job.
  pool.Submit([may_go_on] { may_go_on.wait(); }, {.client = "a", .memory = 80});
  pool.Submit([may_go_on] { may_go_on.wait(); }, {.client = "a", .memory = 80});
  EXPECT_TRUE(Comes([&] { return pool.state().running == 1; }));
  EXPECT_EQ(pool.heart().SilentFor(later()), seconds(0)) << "long jobs are not silence";
  go_on.set_value();
  EXPECT_TRUE(Comes([&] { return pool.state().running == 0 && pool.state().waiting == 0; }));
  EXPECT_EQ(pool.heart().SilentFor(later()), seconds(0));
}

}  // namespace
}  // namespace rilievo
