#include "server/calls/job_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <latch>

namespace rilievo {
namespace {

TEST(JobPool, AdmitsAsManyAsItHasPlacesAndTakesThemBack) {
  JobPool pool(/*workers=*/2, /*waiting=*/1);
  std::vector<JobPool::Ticket> tickets;
  for (int i = 0; i < 3; ++i) {
    auto ticket = pool.TryAdmit();
    ASSERT_TRUE(ticket.has_value()) << i;
    tickets.push_back(*std::move(ticket));
  }
  EXPECT_EQ(pool.admitted(), 3);
  EXPECT_FALSE(pool.TryAdmit().has_value());
  tickets.pop_back();
  EXPECT_EQ(pool.admitted(), 2);
  EXPECT_TRUE(pool.TryAdmit().has_value());
  // That ticket was dropped at once; a moved-from one gives nothing back twice.
  EXPECT_EQ(pool.admitted(), 2);
  tickets.clear();
  EXPECT_EQ(pool.admitted(), 0);
}

TEST(JobPool, NeverRunsMoreThanItsWorkers) {
  JobPool pool(2, 100);
  std::atomic<int> running{0}, most{0}, done{0};
  std::latch all(50);
  for (int i = 0; i < 50; ++i) {
    pool.Submit([&] {
      const int now = ++running;
      int seen = most;
      while (now > seen && !most.compare_exchange_weak(seen, now)) {
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      --running;
      ++done;
      all.count_down();
    });
  }
  all.wait();
  EXPECT_EQ(done, 50);
  EXPECT_EQ(most, 2);
}

TEST(JobPool, FirstComeFirstServed) {
  JobPool pool(1, 10);
  std::promise<void> gate;
  pool.Submit([&] { gate.get_future().wait(); });
  std::vector<int> order;
  std::latch all(5);
  for (int i = 0; i < 5; ++i) {
    pool.Submit([&order, &all, i] {
      order.push_back(i);
      all.count_down();
    });
  }
  gate.set_value();
  all.wait();
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(JobPool, WithdrawsOnlyWhatHasNotStarted) {
  JobPool pool(1, 10);
  std::promise<void> started, gate;
  const uint64_t first = pool.Submit([&] {
    started.set_value();
    gate.get_future().wait();
  });
  started.get_future().wait();
  std::atomic<bool> second_ran{false};
  const auto held = std::make_shared<int>(7);
  const uint64_t second = pool.Submit([&second_ran, held] { second_ran = true; });
  EXPECT_EQ(held.use_count(), 2);
  EXPECT_FALSE(pool.Withdraw(first));
  EXPECT_TRUE(pool.Withdraw(second));
  EXPECT_EQ(held.use_count(), 1) << "withdrawn work must let go of what it holds";
  EXPECT_FALSE(pool.Withdraw(second));
  std::promise<void> third_ran;
  pool.Submit([&] { third_ran.set_value(); });
  gate.set_value();
  third_ran.get_future().wait();
  EXPECT_FALSE(second_ran);
}

TEST(JobPool, DestructionWaitsForWhatRunsAndDropsTheRest) {
  std::atomic<bool> finished{false}, dropped_ran{false};
  std::promise<void> started;
  {
    JobPool pool(1, 10);
    pool.Submit([&] {
      started.set_value();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      finished = true;
    });
    pool.Submit([&] { dropped_ran = true; });
    started.get_future().wait();
  }
  EXPECT_TRUE(finished);
  EXPECT_FALSE(dropped_ran);
}

TEST(JobPool, RetryDelayGrowsWithTheQueueWithinItsBounds) {
  JobPool pool(1, 200);
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(1));
  std::vector<JobPool::Ticket> tickets;
  for (int i = 0; i < 10; ++i) tickets.push_back(*pool.TryAdmit());
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(10));
  for (int i = 0; i < 150; ++i) tickets.push_back(*pool.TryAdmit());
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(60));
}

}  // namespace
}  // namespace rilievo
