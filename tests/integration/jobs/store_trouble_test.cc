// A store whose disk is full, or whose database another program holds.
#include <sys/mount.h>

#include <chrono>
#include <fstream>
#include <future>
#include <thread>

#include "client/library/status_conversion.h"
#include "server/store/sqlite_database.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

v1::CreateJobRequest JobOf(const PackedScan& scan, const std::string& request_id) {
  v1::CreateJobRequest request;
  request.set_request_id(request_id);
  request.set_scan_id(scan.scan_id);
  request.mutable_header()->set_point_count(scan.header.point_count());
  request.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
  return request;
}

// A store on a disk of its own.
class SmallDiskTest : public JobsTest {
 protected:
  ~SmallDiskTest() override {
    daemon_.reset();
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }

  // False where this process may not.
  bool Mount(const std::string& size) {
    std::filesystem::create_directory(folder_);
    mounted_ = mount("tmpfs", folder_.c_str(), "tmpfs", 0, ("size=" + size).c_str()) == 0;
    return mounted_;
  }

  // To the last byte.
  void Fill() const {
    std::ofstream file(folder_ + "/filler", std::ios::binary);
    const std::string block(4096, 'x');
    while (file.write(block.data(), static_cast<std::streamsize>(block.size())).flush()) {
    }
  }
  void MakeRoom() const { std::filesystem::remove(folder_ + "/filler"); }

  bool WaitForNoWorker() const {
    const auto start = steady_clock::now();
    while (!daemon_->Workers().empty() && SecondsSince(start) < 20) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    return daemon_->Workers().empty();
  }

  const std::string folder_ = test_ / "store";
  bool mounted_ = false;
};

TEST_F(SmallDiskTest, AFullDiskIsAClearStatusAndNoEnd) {
  if (!Mount("1m")) GTEST_SKIP() << "this process may not mount a small disk";
  StartServer();
  const PackedScan large = PackScan(SphereScan(200'000));
  const absl::Status full = HastyClient().Upload(large);
  EXPECT_TRUE(absl::IsResourceExhausted(full)) << full;
  EXPECT_EQ(ErrorReason(full), "STORE_FULL");
  EXPECT_TRUE(RetryDelay(full).has_value());
  EXPECT_TRUE(ReconstructionClient(Channel()).GetCapabilities().ok()) << "it goes on";
  // Room again, without a restart.
  std::filesystem::remove_all(folder_ + "/uploads/" + large.scan_id);
  const PointCloud scan = SphereScan(3'000);
  const auto job = Client().Submit(PackScan(scan), {}, "small");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(Client().Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(*Client().Fetch(job->job_id()), Expected(scan));
}

TEST_F(SmallDiskTest, WhileItIsFullWhatNeedsNoRoomWorks) {
  if (!Mount("16m")) GTEST_SKIP() << "this process may not mount a small disk";
  StartServer({"--max-concurrent-jobs", "3", "--threads", "1"});
  const PointCloud small = SphereScan(3'000), medium = SphereScan(60'000);
  const auto done = Client().Submit(PackScan(small), {}, "done");
  ASSERT_TRUE(done.ok()) << done.status();
  ASSERT_EQ(Client().Watch(done->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  const auto cancelled = Client().Submit(PackScan(SphereScan(300'000)), {}, "cancelled");
  const auto ending = Client().Submit(PackScan(medium), {}, "ending");
  ASSERT_TRUE(cancelled.ok() && ending.ok());
  Fill();
  EXPECT_EQ(ErrorReason(HastyClient().Upload(PackScan(SphereScan(4'000)))), "STORE_FULL");

  const auto called = ReconstructionClient(Channel()).Reconstruct(small, {});
  ASSERT_TRUE(called.ok()) << called.status();
  EXPECT_EQ(called->dss, Expected(small));
  const auto start = steady_clock::now();
  const auto stopped = HastyClient().Cancel(cancelled->job_id());
  ASSERT_TRUE(stopped.ok()) << stopped.status();
  EXPECT_EQ(stopped->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_TRUE(HastyClient().Fetch(done->job_id()).ok());
  EXPECT_TRUE(HastyClient().Delete(done->job_id()).ok());
  EXPECT_LT(SecondsSince(start), 5);
  EXPECT_TRUE(absl::IsNotFound(HastyClient().Get(done->job_id()).status()));
  EXPECT_EQ(HastyClient().List(10)->size(), 2u);

  // A result that found no room is not lost.
  EXPECT_TRUE(WaitForNoWorker());
  MakeRoom();
  const auto kept = Client().Watch(ending->job_id());
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->state(), v1::JOB_STATE_SUCCEEDED) << kept->error().message();
  EXPECT_EQ(kept->attempts(), 1u);
  EXPECT_EQ(*Client().Fetch(ending->job_id()), Expected(medium));
  EXPECT_EQ(Client().Get(cancelled->job_id())->state(), v1::JOB_STATE_CANCELLED);
  EXPECT_TRUE(Client().Submit(PackScan(small), {}, "next").ok());
}

TEST_F(JobsTest, ADatabaseThatAnotherProgramHoldsIsWaitedFor) {
  constexpr seconds kHeld{2};
  StartServer({"--max-concurrent-jobs", "3", "--threads", "1"});
  const PackedScan scan = PackScan(SphereScan(3'000));
  ASSERT_TRUE(Client().Upload(scan).ok());
  const auto large = Client().Submit(PackScan(SphereScan(300'000)), {}, "cancelled");
  const auto ending = Client().Submit(PackScan(SphereScan(20'000)), {}, "ending");
  ASSERT_TRUE(large.ok() && ending.ok());
  ASSERT_GT(daemon_->WaitForWorker(seconds(10)), 0);

  auto database = SqliteDatabase::Open(test_ / "store/jobs.db");
  ASSERT_TRUE(database.ok()) << database.status();
  ASSERT_TRUE(database->Execute("BEGIN IMMEDIATE").ok());
  const auto held = steady_clock::now();
  auto created =
      std::async(std::launch::async, [&] { return HastyClient().Create(JobOf(scan, "created")); });
  auto cancelled =
      std::async(std::launch::async, [&] { return HastyClient().Cancel(large->job_id()); });
  EXPECT_EQ(created.wait_for(kHeld), std::future_status::timeout) << "nothing is said too early";
  ASSERT_TRUE(database->Execute("COMMIT").ok());
  const auto job = created.get();
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_TRUE(cancelled.get().ok());
  EXPECT_LT(SecondsSince(held), 5);

  for (const std::string& id : {job->job_id(), ending->job_id()}) {
    const auto end = Client().Watch(id);
    ASSERT_TRUE(end.ok()) << end.status();
    EXPECT_EQ(end->state(), v1::JOB_STATE_SUCCEEDED) << end->error().message();
    EXPECT_EQ(end->attempts(), 1u);
  }
  const auto jobs = Client().List(10);
  ASSERT_TRUE(jobs.ok()) << jobs.status();
  EXPECT_EQ(jobs->size(), 3u);
  for (const v1::Job& one : *jobs) {
    EXPECT_EQ(one.state(),
              one.job_id() == large->job_id() ? v1::JOB_STATE_CANCELLED : v1::JOB_STATE_SUCCEEDED);
  }
}

TEST_F(JobsTest, ACallUnderWayIsAnsweredByAServerThatEnds) {
  StartServer();
  const PackedScan scan = PackScan(SphereScan(3'000));
  ASSERT_TRUE(Client().Upload(scan).ok());
  auto database = SqliteDatabase::Open(test_ / "store/jobs.db");
  ASSERT_TRUE(database.ok()) << database.status();
  ASSERT_TRUE(database->Execute("BEGIN IMMEDIATE").ok());
  auto created =
      std::async(std::launch::async, [&] { return HastyClient().Create(JobOf(scan, "last")); });
  std::this_thread::sleep_for(seconds(1));  // it has arrived by then
  daemon_->Signal(SIGTERM);
  EXPECT_EQ(created.wait_for(seconds(1)), std::future_status::timeout);
  ASSERT_TRUE(database->Execute("COMMIT").ok());
  const auto job = created.get();
  EXPECT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(daemon_->WaitForExit(seconds(10)), 0);
}

}  // namespace
}  // namespace rilievo
