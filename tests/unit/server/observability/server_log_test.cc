#include "server/observability/server_log.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "server/observability/library_log.h"
#include "server/observability/line_rate.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

struct Pipe {
  // As in the server: a writer may still be at it when the reader is gone.
  Pipe() {
    std::signal(SIGPIPE, SIG_IGN);
    EXPECT_EQ(pipe2(ends, O_CLOEXEC), 0);
  }
  ~Pipe() {
    close(ends[0]);
    if (ends[1] >= 0) close(ends[1]);
  }
  // What was written, once nobody writes any more.
  std::vector<std::string> Lines() {
    close(std::exchange(ends[1], -1));
    std::string text;
    char buffer[65'536];
    for (ssize_t n; (n = read(ends[0], buffer, sizeof(buffer))) > 0;) {
      text.append(buffer, static_cast<size_t>(n));
    }
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }
  int ends[2];
};

TEST(LineWriter, WritesWholeLinesInOrderFromAllThreads) {
  Pipe pipe;
  std::vector<std::string> lines;
  std::jthread reader;
  {
    LineWriter writer(pipe.ends[1]);
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&, i] {
        // A line longer than what a pipe takes at once stays one line.
        for (int k = 0; k < 10; ++k) {
          EXPECT_TRUE(writer.Write(std::to_string(i) + std::to_string(k) + std::string(700, 'x')));
        }
      });
    }
    threads.clear();
    reader = std::jthread([&] {
      std::this_thread::sleep_for(milliseconds(50));
      lines = pipe.Lines();
    });
    EXPECT_TRUE(writer.Flush(seconds(10)));
  }
  reader.join();
  ASSERT_EQ(lines.size(), 40u);
  std::vector<int> next(4, 0);
  for (const std::string& line : lines) {
    EXPECT_EQ(line.size(), 702u);
    EXPECT_EQ(line[1] - '0', next[static_cast<size_t>(line[0] - '0')]++);
  }
}

TEST(LineWriter, NeverWaitsForAReader) {
  Pipe pipe;
  std::chrono::steady_clock::time_point closing;
  {
    LineWriter writer(pipe.ends[1], 10'000);
    const std::string line(99, 'x');
    do {
      for (int i = 0; i < 50; ++i) EXPECT_TRUE(writer.Write(line));
    } while (writer.Flush(milliseconds(50)));
    const auto start = std::chrono::steady_clock::now();
    int taken = 0;
    for (int i = 0; i < 10'000; ++i) taken += writer.Write(line) ? 1 : 0;
    EXPECT_LT(std::chrono::steady_clock::now() - start, seconds(1));
    EXPECT_LE(taken, 100) << "the queue";
    EXPECT_EQ(writer.dropped(), 10'000u - static_cast<uint64_t>(taken));
    closing = std::chrono::steady_clock::now();
  }
  EXPECT_LT(std::chrono::steady_clock::now() - closing, LineWriter::kLastTime + seconds(2));
}

// Its thread may still look for room when the file is closed and the number given away.
TEST(LineWriter, NeverWritesToAnotherFileOfTheSameNumber) {
  Pipe stalled;
  {
    LineWriter writer(stalled.ends[1]);
    while (writer.Flush(milliseconds(20))) writer.Write(std::string(10'000, 'x'));
  }
  Pipe other;
  ASSERT_GE(dup3(other.ends[1], stalled.ends[1], O_CLOEXEC), 0);
  std::this_thread::sleep_for(milliseconds(300));
  pollfd anything{other.ends[0], POLLIN, 0};
  EXPECT_EQ(poll(&anything, 1, 0), 0);
}

TEST(LineWriter, LinesForNobodyAreCounted) {
  Pipe pipe;
  close(std::exchange(pipe.ends[0], -1));
  LineWriter writer(pipe.ends[1]);
  EXPECT_TRUE(writer.Write("one"));
  EXPECT_TRUE(writer.Flush(seconds(10)));
  EXPECT_EQ(writer.dropped(), 1u);
}

TEST(ServerLog, TellsHowManyLinesWereDropped) {
  Pipe pipe;
  std::vector<std::string> lines;
  int written = 0;
  {
    ServerLog log(pipe.ends[1], ServerLog::Format::kJson);
    const std::string kilobyte(1000, 'x');
    while (log.dropped() < 5) {
      log.Event("many", {{"message", kilobyte}});
      ++written;
    }
    std::jthread reader([&, end = dup(pipe.ends[0])] {
      char buffer[65'536];
      std::string text;
      while (text.find("last") == std::string::npos || text.back() != '\n') {
        const ssize_t n = read(end, buffer, sizeof(buffer));
        if (n <= 0) break;
        text.append(buffer, static_cast<size_t>(n));
      }
      std::istringstream stream(text);
      for (std::string line; std::getline(stream, line);) lines.push_back(line);
      close(end);
    });
    ASSERT_TRUE(log.Flush(seconds(10)));
    log.Event("first", {{"message", "after the stall"}});
    ASSERT_TRUE(log.Flush(seconds(10)));
    log.Event("last", {});
    ASSERT_TRUE(log.Flush(seconds(10)));
  }
  int many = 0;
  std::string told;
  for (const std::string& line : lines) {
    const auto json = nlohmann::json::parse(line);
    many += json["event"] == "many" ? 1 : 0;
    if (json["event"] == "log") told = json["message"];
  }
  EXPECT_EQ(many, written - 5);
  EXPECT_THAT(told, HasSubstr("5 lines were dropped"));
}

TEST(EventLine, NoValueForgesALine) {
  const EventFields fields = {{"message", "a\n{\"event\":\"job\"}\x1b[31m\xff"}};
  const std::string json = EventJson("2026-01-31T12:00:00Z", "library", fields);
  EXPECT_EQ(json.find('\n'), std::string::npos);
  EXPECT_EQ(json.find('\x1b'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(json)["event"], "library");
  EXPECT_EQ(EventText("2026-01-31T12:00:00Z", "library", fields),
            "2026-01-31T12:00:00Z library message=\"a?{?event?:?job?}?[31m?\"");
}

TEST(LineRate, CountsWhatItLeavesOut) {
  LineRate rate(2);
  const LineRate::Clock::time_point start{seconds(100)};
  EXPECT_EQ(rate.Pass(start), 0u);
  EXPECT_EQ(rate.Pass(start), 0u);
  EXPECT_EQ(rate.Pass(start + milliseconds(900)), std::nullopt);
  EXPECT_EQ(rate.Pass(start + milliseconds(999)), std::nullopt);
  EXPECT_EQ(rate.Pass(start + milliseconds(1000)), 2u);
  EXPECT_EQ(rate.Pass(start + milliseconds(1001)), 0u);
}

}  // namespace
}  // namespace rilievo
