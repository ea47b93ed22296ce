#include "server/worker/in_worker_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <stop_token>
#include <thread>
#include <variant>

#include "core/base/sanitized.h"
#include "core/pipeline/reconstruct.h"
#include "tests/unit/server/worker/moody_worker.h"

namespace rilievo {
namespace {

using std::chrono::steady_clock;
using testing::ElementsAre;
using testing::HasSubstr;

double SecondsSince(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

JobRequest Request(Mood mood, int64_t points = 20) {
  v1::ReconstructHeader header;
  header.set_point_count(static_cast<uint64_t>(points));
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  header.mutable_options()->set_seed(static_cast<uint64_t>(mood));
  header.mutable_options()->set_threads(2);
  return std::get<JobRequest>(ParseHeader(header, {}));
}

ScanBytes Zeros(int64_t points = 20) {
  return ScanBytes({std::string(static_cast<size_t>(24 * points), '\0')});
}

absl::StatusOr<JobResult> RunMoody(Mood mood, WorkerSettings settings = {},
                                   RunContext context = {}) {
  settings.program = RILIEVO_MOODY_WORKER;
  return InWorkerProcess(settings)(Request(mood), Zeros(), context);
}

TEST(InWorkerProcess, ResultAndProgressComeWhole) {
  RunContext context;
  std::vector<Progress> events;
  context.progress = [&](const Progress& progress) { events.push_back(progress); };
  const auto result = RunMoody(Mood::kWell, {}, context);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.points_in(), 20);
  ASSERT_EQ(result->encoded.chunks.size(), 4u);
  EXPECT_EQ(result->encoded.chunks[0], std::vector<uint8_t>(10, 1));
  EXPECT_TRUE(result->encoded.chunks[1].empty());
  EXPECT_EQ(result->encoded.chunks[2], std::vector<uint8_t>(3'000'000, 2));
  EXPECT_TRUE(result->encoded.chunks[3].empty());
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].stage, Stage::kNormals);
  EXPECT_EQ(events[0].fraction, 0.5);
}

TEST(InWorkerProcess, TheWorkerIsShutIn) {
  // As in rilievod, whose threads block the signals that end it.
  sigset_t term;
  sigemptyset(&term);
  sigaddset(&term, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &term, nullptr);
  const auto result =
      RunMoody(Mood::kWell, {.program = {}, .memory_bytes = 0, .processor_seconds = 40});
  pthread_sigmask(SIG_UNBLOCK, &term, nullptr);
  ASSERT_TRUE(result.ok()) << result.status();
  // Files, bytes written, core, processor seconds of two threads; points are closed when decoded.
  EXPECT_EQ(result->report.road_reason(), "32 0 0 80 term=0 open=3 own_group=1");
}

TEST(InWorkerProcess, AFailureKeepsItsCode) {
  EXPECT_EQ(RunMoody(Mood::kRefuse).status(), absl::FailedPreconditionError("not planar"));
}

TEST(InWorkerProcess, EveryWayToDieHasItsStatus) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer takes the signals of a crash for itself";
  EXPECT_EQ(RunMoody(Mood::kCrash).status().code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(RunMoody(Mood::kCrash).status().message()), HasSubstr("signal 11"));
  EXPECT_THAT(std::string(RunMoody(Mood::kExit).status().message()), HasSubstr("code 77"));
  EXPECT_EQ(RunMoody(Mood::kExit).status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(RunMoody(Mood::kThrow).status().code(), absl::StatusCode::kInternal);
  EXPECT_EQ(RunMoody(Mood::kKilled).status().code(), absl::StatusCode::kAborted);
}

TEST(InWorkerProcess, MemoryIsLimited) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer maps memory of its own";
  const WorkerSettings settings{.program = {}, .memory_bytes = 100 << 20};
  const auto hungry = RunMoody(Mood::kHungry, settings);
  EXPECT_EQ(hungry.status().code(), absl::StatusCode::kResourceExhausted) << hungry.status();
  EXPECT_THAT(std::string(hungry.status().message()), HasSubstr("104 MB"));
  const auto modest = RunMoody(Mood::kModest, settings);
  EXPECT_TRUE(modest.ok()) << modest.status();
}

TEST(InWorkerProcess, ProcessorTimeIsLimited) {
  const auto start = steady_clock::now();
  const auto spun =
      RunMoody(Mood::kSpin, {.program = {}, .memory_bytes = 0, .processor_seconds = 1});
  EXPECT_EQ(spun.status().code(), absl::StatusCode::kDeadlineExceeded) << spun.status();
  EXPECT_GT(SecondsSince(start), 1);
}

TEST(InWorkerProcess, AStopEndsEvenAWorkerThatDoesNotListen) {
  for (const Mood mood : {Mood::kSleep, Mood::kSpin}) {
    std::stop_source stop;
    RunContext context;
    context.stop = stop.get_token();
    steady_clock::time_point stopped;
    const std::jthread stopper([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
      stopped = steady_clock::now();
      stop.request_stop();
    });
    EXPECT_EQ(RunMoody(mood, {}, context).status().code(), absl::StatusCode::kCancelled);
    EXPECT_LT(SecondsSince(stopped), 1);
  }
}

TEST(InWorkerProcess, AProgramThatIsNoneIsAnError) {
  const auto missing =
      InWorkerProcess({.program = "/nonexistent/worker"})(Request(Mood::kWell), Zeros(), {});
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kInternal);
  const auto silent = InWorkerProcess({.program = "/bin/true"})(Request(Mood::kWell), Zeros(), {});
  EXPECT_EQ(silent.status().code(), absl::StatusCode::kInternal) << silent.status();
  const auto talks = InWorkerProcess({.program = "/bin/cat"})(Request(Mood::kWell), Zeros(), {});
  EXPECT_FALSE(talks.ok());
}

TEST(InWorkerProcess, TheRealWorkerGivesTheBytesOfTheLibrary) {
  constexpr int64_t kPoints = 3000;
  PointCloud scan;
  scan.points.resize(3, kPoints);
  for (int64_t i = 0; i < kPoints; ++i) {
    const double z = 1 - (2.0 * static_cast<double>(i) + 1) / kPoints;
    const double r = std::sqrt(1 - z * z), a = 2.399963 * static_cast<double>(i);
    scan.points.col(i) << r * std::cos(a), r * std::sin(a), z;
  }
  std::string bytes(reinterpret_cast<const char*>(scan.points.data()), 24 * kPoints);
  const JobRequest job = Request(Mood::kWell, kPoints);
  const auto worked = InWorkerProcess({.program = RILIEVO_WORKER, .memory_bytes = 1 << 30})(
      job, ScanBytes({std::move(bytes)}), {});
  ASSERT_TRUE(worked.ok()) << worked.status();
  const auto direct = Reconstruct(scan, job.options, {});
  ASSERT_TRUE(direct.ok());
  EXPECT_EQ(worked->encoded.chunks, direct->encoded.chunks);
  EXPECT_EQ(worked->report.road(), direct->report.road);
}

}  // namespace
}  // namespace rilievo
