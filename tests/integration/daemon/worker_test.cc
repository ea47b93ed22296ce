// rilievod and its workers: what happens to one process when another ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <future>

#include "client/library/reconstruction_client.h"
#include "client/library/status_conversion.h"
#include "core/base/sanitized.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/simulated_scans.h"

namespace rilievo {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;

// False for a zombie that nobody has waited for.
bool Runs(pid_t process) {
  std::error_code error;
  const auto program =
      std::filesystem::read_symlink("/proc/" + std::to_string(process) + "/exe", error);
  return !program.empty();
}

TEST(Worker, AKilledOneFailsItsJobAlone) {
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const PointCloud scan = SphereScan(100'000);
  auto result = std::async(std::launch::async, [&] { return client.Reconstruct(scan, {}); });
  const pid_t worker = daemon.WaitForWorker(seconds(10));
  ASSERT_GT(worker, 0);
  kill(worker, SIGKILL);
  const absl::Status status = result.get().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  EXPECT_EQ(ErrorReason(status), "WORKER_KILLED");
  EXPECT_TRUE(RetryDelay(status).has_value());
  EXPECT_TRUE(client.Reconstruct(SphereScan(1'000), {}).ok()) << "the server goes on";
  EXPECT_TRUE(daemon.Workers().empty());
}

TEST(Worker, ACrashIsInternalAndItsCauseStaysWithTheOperator) {
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const PointCloud scan = SphereScan(100'000);
  auto result = std::async(std::launch::async, [&] { return client.Reconstruct(scan, {}); });
  const pid_t worker = daemon.WaitForWorker(seconds(10));
  ASSERT_GT(worker, 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // until it works on the job
  kill(worker, SIGABRT);
  const absl::Status status = result.get().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << status;
  EXPECT_EQ(status.message(), "the server failed; its operator finds the cause in the log");
  EXPECT_TRUE(daemon.WaitForLine("signal 6", seconds(5)).has_value());
}

TEST(Worker, MemoryBeyondItsLimitIsRefusedAndTheServerStaysSmall) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer maps memory of its own";
  DaemonProcess daemon({"--max-job-memory", "60000000"});
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const auto large = client.Reconstruct(SphereScan(300'000), {});
  EXPECT_EQ(large.status().code(), absl::StatusCode::kResourceExhausted) << large.status();
  const auto small = client.Reconstruct(SphereScan(2'000), {});
  EXPECT_TRUE(small.ok()) << small.status();
  EXPECT_LT(daemon.PeakBytes(), 100 << 20);
}

TEST(Worker, NoneOutlivesItsServer) {
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const PointCloud scan = SphereScan(200'000);
  auto result = std::async(std::launch::async, [&] { return client.Reconstruct(scan, {}); });
  const pid_t worker = daemon.WaitForWorker(seconds(10));
  ASSERT_GT(worker, 0);
  daemon.Signal(SIGKILL);
  const auto end = std::chrono::steady_clock::now() + seconds(1);
  while (Runs(worker) && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_FALSE(Runs(worker));
  EXPECT_EQ(result.get().status().code(), absl::StatusCode::kUnavailable);
}

TEST(Worker, TheServerSaysWhereItLooksForTheProgram) {
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--worker", "/nonexistent"}), 1);
  DaemonProcess in_process({"--in-process"});
  const ReconstructionClient client(ConnectPlaintext(in_process.address()));
  auto result =
      std::async(std::launch::async, [&] { return client.Reconstruct(SphereScan(50'000), {}); });
  EXPECT_EQ(in_process.WaitForWorker(std::chrono::milliseconds(200)), -1);
  EXPECT_TRUE(result.get().ok());
}

}  // namespace
}  // namespace rilievo
