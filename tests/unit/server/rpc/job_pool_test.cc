#include "server/rpc/job_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <latch>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace rilievo {
namespace {

TEST(JobPool, AdmitsAsManyAsItHasPlacesAndTakesThemBack) {
  JobPool pool(/*workers=*/2, /*waiting=*/1);
  std::vector<JobPool::Ticket> tickets;
  for (int i = 0; i < 3; ++i) {
    auto ticket = pool.TryAdmit(std::string(1, static_cast<char>('a' + i)));
    ASSERT_TRUE(ticket.has_value()) << i;
    tickets.push_back(*std::move(ticket));
  }
  EXPECT_EQ(pool.admitted(), 3);
  EXPECT_FALSE(pool.TryAdmit().has_value());
  tickets.pop_back();
  EXPECT_EQ(pool.admitted(), 2);
  EXPECT_TRUE(pool.TryAdmit("c").has_value());
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

TEST(JobPool, OneClientLeavesPlacesToOthers) {
  JobPool pool(/*workers=*/2, /*waiting=*/8);
  std::vector<JobPool::Ticket> tickets;
  while (auto ticket = pool.TryAdmit("mallory")) tickets.push_back(*std::move(ticket));
  EXPECT_EQ(tickets.size(), 5u);
  EXPECT_TRUE(pool.TryAdmit("alice").has_value());
}

TEST(JobPool, ASuspectRunsAloneAndLast) {
  JobPool pool(/*workers=*/2, /*waiting=*/0);
  std::promise<void> started, gate;
  std::mutex mutex;
  std::vector<std::string> order;
  std::atomic<int> running{0};
  std::promise<void> done;
  const auto work = [&](const std::string& name) {
    return [&, name] {
      const int beside = running++;
      const std::lock_guard lock(mutex);
      order.push_back(name);
      if (name == "suspect") {
        EXPECT_EQ(beside, 0);
      }
      --running;
      if (order.size() == 4) done.set_value();
    };
  };
  pool.Submit([&] {
    started.set_value();
    gate.get_future().wait();
  });
  started.get_future().wait();
  const uint64_t withdrawn = pool.Submit(work("withdrawn"), {.client = "a", .last = true});
  pool.Submit(work("suspect"), {.client = "a", .last = true});
  EXPECT_TRUE(pool.Withdraw(withdrawn));
  EXPECT_EQ(pool.state().waiting, 1);
  for (int i = 0; i < 3; ++i) pool.Submit(work("other"), {.client = "b"});
  gate.set_value();
  done.get_future().wait();
  EXPECT_EQ(order.back(), "suspect");
}

TEST(JobPool, RetryDelayGrowsWithTheQueueWithinItsBounds) {
  JobPool pool(1, 400);
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(1));
  std::vector<JobPool::Ticket> tickets;
  for (int i = 0; i < 10; ++i) tickets.push_back(*pool.TryAdmit());
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(10));
  for (int i = 0; i < 150; ++i) tickets.push_back(*pool.TryAdmit());
  EXPECT_EQ(pool.RetryDelay(), std::chrono::seconds(60));
}

// Blocks the only worker until it is released, then tells in which order the others ran.
std::string OrderOf(JobPool* pool, const std::vector<JobPool::Demand>& demands) {
  std::promise<void> gate, all;
  pool->Submit([&] { gate.get_future().wait(); });
  std::mutex mutex;
  std::string order;
  for (const auto& demand : demands) {
    pool->Submit(
        [&, name = demand.client] {
          const std::lock_guard lock(mutex);
          order += name;
          if (order.size() == demands.size()) all.set_value();
        },
        demand);
  }
  gate.set_value();
  all.get_future().wait();
  return order;
}

TEST(JobPool, ClientsTakeTurns) {
  JobPool pool(1, 100);
  EXPECT_EQ(OrderOf(&pool, {{"a"}, {"a"}, {"a"}, {"a"}, {"b"}, {"b"}, {"c"}}), "abcabaa");
}

TEST(JobPool, RunningJobsKeepWithinTheMemory) {
  JobPool pool(4, 100, /*memory=*/100);
  std::mutex mutex;
  int64_t in_use = 0, most = 0;
  std::string order;
  std::promise<void> all;
  const std::vector<int64_t> needs = {60, 30, 60, 10, 10, 500, 20, 100};
  for (const int64_t memory : needs) {
    pool.Submit(
        [&, memory] {
          {
            const std::lock_guard lock(mutex);
            in_use += memory;
            if (memory <= 100) most = std::max(most, in_use);
            if (memory == 500) {
              EXPECT_EQ(in_use, 500) << "more than there is: alone";
            }
          }
          std::this_thread::sleep_for(std::chrono::milliseconds(10));
          const std::lock_guard lock(mutex);
          in_use -= memory;
          order += 'x';
          if (order.size() == needs.size()) all.set_value();
        },
        {.client = "", .memory = memory});
  }
  all.get_future().wait();
  EXPECT_LE(most, 100);
  EXPECT_GE(most, 90) << "two at a time where they fit";
}

TEST(JobPool, AWithdrawnJobGivesWayToTheNext) {
  JobPool pool(2, 100, /*memory=*/100);
  std::promise<void> gate, small;
  pool.Submit([&] { gate.get_future().wait(); }, {.client = "", .memory = 60});
  const uint64_t large = pool.Submit([] {}, {.client = "", .memory = 60});
  pool.Submit([&] { small.set_value(); }, {.client = "", .memory = 10});
  auto done = small.get_future();
  EXPECT_EQ(done.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout)
      << "nobody overtakes";
  EXPECT_TRUE(pool.Withdraw(large));
  EXPECT_EQ(done.wait_for(std::chrono::seconds(10)), std::future_status::ready);
  gate.set_value();
}

TEST(JobPool, NothingBeginsWhileItIsHeld) {
  JobPool pool(2, 0);
  std::atomic<int> done = 0;
  pool.Hold(std::chrono::hours(1));
  pool.Submit([&] { ++done; });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(done, 0);
  EXPECT_EQ(pool.state().waiting, 1);
  pool.Hold(std::chrono::milliseconds(0));
  while (done < 1) std::this_thread::yield();

  const auto begin = std::chrono::steady_clock::now();
  pool.Hold(std::chrono::milliseconds(60));
  pool.Submit([&] { ++done; });
  while (done < 2) std::this_thread::yield();
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(60));
  pool.Hold(std::chrono::hours(1));  // and it can be closed so
}

TEST(JobPool, WhatIsOnItsWayTakesOfTheMemoryOfJobs) {
  JobPool pool(2, 0, 100);
  std::optional<JobPool::Charge> first = pool.TryCharge(200);
  EXPECT_TRUE(first) << "the only one";
  EXPECT_FALSE(pool.TryCharge(1));
  first->Set(60);
  EXPECT_FALSE(pool.TryCharge(41));
  {
    JobPool::Charge second = *pool.TryCharge(40);
    JobPool::Charge moved = std::move(second);
    EXPECT_FALSE(pool.TryCharge(1));
  }
  std::atomic<bool> end = false;
  std::atomic<int> begun = 0;
  const auto work = [&] {
    ++begun;
    while (!end) std::this_thread::yield();
  };
  pool.Submit(work, {.client = "", .memory = 90});  // alone, though more is charged
  pool.Submit(work, {.client = "", .memory = 10});
  while (begun < 1) std::this_thread::yield();
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  EXPECT_EQ(begun, 1);
  first.reset();
  while (begun < 2) std::this_thread::yield();
  end = true;
}

}  // namespace
}  // namespace rilievo
