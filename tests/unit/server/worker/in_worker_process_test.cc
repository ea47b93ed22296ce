#include "server/worker/in_worker_process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stop_token>
#include <thread>
#include <variant>

#include "core/base/sanitized.h"
#include "core/pipeline/reconstruct.h"
#include "tests/unit/server/store/test_folder.h"
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
  return (*InWorkerProcess(settings))(Request(mood), Zeros(), context);
}

absl::StatusOr<JobResult> RunProgram(const std::string& program) {
  return (*InWorkerProcess({.program = program}))(Request(Mood::kWell), Zeros(), {});
}

// A program of that text or those bytes.
std::string WriteProgram(const TestFolder& folder, const std::string& name,
                         const std::string& content) {
  const std::string path = folder / name;
  std::ofstream(path, std::ios::binary) << content;
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

std::string ContentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
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
  EXPECT_EQ(result->report.road_reason(), "32 0 0 80 term=0 open=4 own_group=1");
}

TEST(WorkerSandbox, ACompromisedWorkerReachesNothing) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer needs more than a job";
  setenv("RILIEVO_TEST_SECRET", "of the server", 1);
  const auto result = RunMoody(Mood::kCompromised);
  unsetenv("RILIEVO_TEST_SECRET");
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.road_reason(), "from the job:; from an earlier thread:");
}

TEST(InWorkerProcess, TheMemoryThatAWorkerTookIsKnown) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer maps memory of its own";
  const auto small = RunMoody(Mood::kWell);
  const auto large = RunMoody(Mood::kModest);
  EXPECT_GT(PeakBytes(small), 1 << 20);
  EXPECT_GT(PeakBytes(large) - PeakBytes(small), 50 << 20);
  EXPECT_GT(PeakBytes(RunMoody(Mood::kRefuse)), 1 << 20);
  EXPECT_EQ(PeakBytes(RunMoody(Mood::kExit)), 0);
}

TEST(InWorkerProcess, AnAnswerBeyondAnySurfaceIsRefused) {
  for (const Mood mood : {Mood::kManyChunks, Mood::kLargeChunk, Mood::kForeignCode}) {
    EXPECT_EQ(RunMoody(mood).status().code(), absl::StatusCode::kInternal);
  }
}

TEST(InWorkerProcess, AProgramIsTheOneThatItWasWhenTheServerBegan) {
  const TestFolder folder;
  const std::string program = WriteProgram(folder, "worker", ContentOf(RILIEVO_MOODY_WORKER));
  const JobWork work = *InWorkerProcess({.program = program});
  std::filesystem::rename(WriteProgram(folder, "new", ContentOf("/bin/false")), program);
  EXPECT_TRUE(work(Request(Mood::kWell), Zeros(), {}).ok());
  std::filesystem::remove(program);
  EXPECT_TRUE(work(Request(Mood::kWell), Zeros(), {}).ok());
}

// Each is refused as trouble of this machine, which no job is to blame for.
TEST(InWorkerProcess, AWorkerOfAnotherVersionIsRefused) {
  const TestFolder folder;
  std::string bytes = ContentOf(RILIEVO_WORKER);
  std::string other = RILIEVO_VERSION;
  other.back() = other.back() == '0' ? '1' : '0';
  for (size_t at; (at = bytes.find(RILIEVO_VERSION)) != std::string::npos;) {
    bytes.replace(at, other.size(), other);
  }
  const auto newer = RunProgram(WriteProgram(folder, "newer", bytes));
  EXPECT_EQ(newer.status().code(), absl::StatusCode::kUnavailable) << newer.status();
  EXPECT_THAT(std::string(newer.status().message()),
              HasSubstr("of version " + other + ", the server of " RILIEVO_VERSION));
  // Those before workers said that they were ready: failure 13, "older", is all that they said.
  const auto older = RunProgram(
      WriteProgram(folder, "older",
                   "#!/bin/sh\nprintf '\\013\\0\\0\\0\\022\\011\\010\\015\\022\\005older' >&3\n"));
  EXPECT_EQ(older.status(), absl::UnavailableError("older"));
}

TEST(InWorkerProcess, AFailureKeepsItsCode) {
  const absl::Status refused = RunMoody(Mood::kRefuse).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(refused.message(), "not planar");
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
  EXPECT_EQ(InWorkerProcess({.program = "/nonexistent/worker"}).status().code(),
            absl::StatusCode::kNotFound);
  // No program, one that ends at once, one that speaks another language.
  for (const char* program : {"/etc/passwd", "/bin/true", "/bin/cat"}) {
    const auto result = RunProgram(program);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kUnavailable) << result.status();
  }
}

TEST(InWorkerProcess, WithoutFileHandlesItIsTheMachinesTrouble) {
  const JobWork work = *InWorkerProcess({.program = RILIEVO_MOODY_WORKER});
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const FileDescriptor free(dup(0));
  for (const int handles : {0, 1, 2}) {
    const rlimit few{static_cast<rlim_t>(free.number() + handles), before.rlim_max};
    setrlimit(RLIMIT_NOFILE, &few);
    const auto result = work(Request(Mood::kWell), Zeros(), {});
    setrlimit(RLIMIT_NOFILE, &before);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kUnavailable) << result.status();
  }
  EXPECT_TRUE(work(Request(Mood::kWell), Zeros(), {}).ok());
}

TEST(InWorkerProcess, AScanThatIsNotWhatItsHashSaysIsNotWorkedOn) {
  const JobWork work = *InWorkerProcess({.program = RILIEVO_MOODY_WORKER});
  const auto run = [&](char last) {
    FileDescriptor file(memfd_create("scan", MFD_CLOEXEC));
    std::string bytes(24 * 20, '\0');
    bytes.back() = last;
    EXPECT_TRUE(file.Write(bytes.data(), bytes.size()).ok());
    // Of 480 zeros.
    constexpr char kHash[] = "4b48f21a4b7a02bfbec19ef880a967a02334a3cdcef8ae83de2ef327ba8bc5dd";
    return work(Request(Mood::kWell), ScanBytes(std::move(file), kHash), {});
  };
  EXPECT_TRUE(run('\0').ok()) << run('\0').status();
  EXPECT_EQ(run('\1').status().code(), absl::StatusCode::kDataLoss);
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
  const auto worked = (*InWorkerProcess({.program = RILIEVO_WORKER, .memory_bytes = 1 << 30}))(
      job, ScanBytes({std::move(bytes)}), {});
  ASSERT_TRUE(worked.ok()) << worked.status();
  const auto direct = Reconstruct(scan, job.options, {});
  ASSERT_TRUE(direct.ok());
  EXPECT_EQ(worked->encoded.chunks, direct->encoded.chunks);
  EXPECT_EQ(worked->report.road(), direct->report.topology);
}

}  // namespace
}  // namespace rilievo
