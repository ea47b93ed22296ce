#include "server/auth/connection_judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr int64_t kMegabyte = 1'000'000;

ConnectionState State(uint64_t number, int64_t read, TransportStreams streams,
                      const std::string& address = "a") {
  return {number, address, {.read = read, .sent = 0}, streams};
}

class ConnectionJudgeTest : public testing::Test {
 protected:
  // The numbers of those that should be closed, 20 ms after the last look.
  std::vector<uint64_t> Closed(const std::vector<ConnectionState>& all, bool busy = false,
                               int64_t resident = 0) {
    std::vector<uint64_t> numbers;
    now_ += milliseconds(20);
    for (const Offence& offence : judge_.Judge(all, busy, resident, now_)) {
      EXPECT_FALSE(offence.words.empty());
      numbers.push_back(offence.number);
    }
    return numbers;
  }

  ConnectionJudge judge_{{.connection_streams = 100, .open_calls = 600, .memory = 500 * kMegabyte}};
  ConnectionJudge::Clock::time_point now_{seconds(1000)};
};

TEST_F(ConnectionJudgeTest, MoreCallsThanAreAllowed) {
  EXPECT_THAT(Closed({State(1, 1, {.started = 90'000, .ended = 89'900})}), IsEmpty());
  EXPECT_THAT(Closed({State(1, 1, {.started = 90'400, .ended = 90'044})}), IsEmpty())
      << "a client may not know the limit yet";
  EXPECT_THAT(Closed({State(1, 1, {.started = 90'400, .ended = 90'043})}), ElementsAre(1));
}

TEST_F(ConnectionJudgeTest, BytesWithoutAMessage) {
  const auto at = [](int64_t read, int64_t messages) {
    return State(1, read, {.started = 1, .messages = messages});
  };
  EXPECT_THAT(Closed({at(1000, 0)}), IsEmpty());
  EXPECT_THAT(Closed({at(41 * kMegabyte, 0)}), IsEmpty());
  EXPECT_THAT(Closed({at(60 * kMegabyte, 9)}), IsEmpty()) << "messages came";
  EXPECT_THAT(Closed({at(102 * kMegabyte, 9)}), ElementsAre(1));
}

TEST_F(ConnectionJudgeTest, HeadersWithoutAnEndKeepTheProcessorsBusy) {
  const auto look = [&](int64_t read, int64_t sent, bool busy) {
    ConnectionState state = State(1, read, {.started = 1});
    state.traffic.sent = sent;
    return Closed({state}, busy);
  };
  int64_t read = 0;
  for (int i = 0; i < 50; ++i) {
    EXPECT_THAT(look(read += 100'000, 0, /*busy=*/false), IsEmpty())
        << "who has processors to spare";
  }
  for (int i = 0; i < 20; ++i) {
    EXPECT_THAT(look(read += 1'000'000, i + 1, /*busy=*/true), IsEmpty())
        << "its window is widened";
  }
  for (int i = 0; i < 4; ++i) EXPECT_THAT(look(read += 100'000, 20, true), IsEmpty()) << i;
  EXPECT_THAT(look(read, 20, true), IsEmpty()) << "it has stopped";
  EXPECT_THAT(look(read += 1, 20, true), ElementsAre(1));
}

TEST_F(ConnectionJudgeTest, HeadersWithoutAnEndAreNotTakenForEver) {
  int64_t read = 0;
  for (int i = 0; i < 11; ++i) {
    EXPECT_THAT(Closed({State(1, read += 524'288, {.started = 1})}), IsEmpty());
  }
  EXPECT_THAT(Closed({State(1, read += 1'000, {.started = 1})}), ElementsAre(1));
}

TEST_F(ConnectionJudgeTest, MessagesThatEndAreNoHeaders) {
  for (int64_t i = 1; i < 50; ++i) {
    EXPECT_THAT(Closed({State(1, i * 524'288, {.started = 1, .messages = 20'000 * i})}, true),
                IsEmpty())
        << "small messages cost more than their bytes explain";
  }
}

TEST_F(ConnectionJudgeTest, TooManyCallsOfAllEndAtTheAddressThatHasMost) {
  std::vector<ConnectionState> all = {State(1, 1, {.started = 90}, "honest")};
  for (uint64_t i = 2; i < 12; ++i) all.push_back(State(i, 1, {.started = 51}, "hostile"));
  EXPECT_THAT(Closed(all), IsEmpty()) << "600";
  all.push_back(State(12, 1, {.started = 51}, "hostile"));
  EXPECT_THAT(Closed(all), ElementsAre(12)) << "the youngest of them, and no more than needed";
}

TEST_F(ConnectionJudgeTest, OverItsMemoryTheServerClosesWhatCostsMost) {
  const std::vector<ConnectionState> all = {
      State(1, 1, {.started = 2}, "honest"), State(2, 1, {.started = 99}, "hostile"),
      State(3, 20 * kMegabyte, {.started = 9}, "hostile"), State(4, 1, {}, "idle")};
  Closed(all);
  const auto grown = [&](int64_t read) {
    auto now = all;
    now[2].traffic.read = read;
    return now;
  };
  EXPECT_THAT(Closed(grown(40 * kMegabyte), false, 500 * kMegabyte), IsEmpty());
  EXPECT_THAT(Closed(grown(41 * kMegabyte), false, 510 * kMegabyte), ElementsAre(3));
  EXPECT_THAT(Closed(all, false, 900 * kMegabyte), ElementsAre(2, 3, 1))
      << "nobody is closed whose connection costs nothing";
}

TEST_F(ConnectionJudgeTest, WhatGrpcDoesNotTellStaysAsItWas) {
  EXPECT_THAT(Closed({State(1, 1, {.started = 100})}), IsEmpty());
  EXPECT_THAT(Closed({{1, "a", {.read = 2, .sent = 0}, std::nullopt}}), IsEmpty());
  EXPECT_THAT(Closed({State(1, 3, {.started = 357})}), ElementsAre(1));
  EXPECT_THAT(Closed({{1, "a", {.read = 4, .sent = 0}, std::nullopt}}), IsEmpty())
      << "forgotten with its verdict";
}

}  // namespace
}  // namespace rilievo
