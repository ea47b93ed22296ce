// What goes wrong with the machine, or is changed on it, is not the fault of a job.
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "grpc/health/v1/health.grpc.pb.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using grpc::health::v1::HealthCheckResponse;
using std::chrono::seconds;

class MachineTroubleTest : public JobsTest {
 protected:
  // A program of that content under that name, in one step as a package manager puts it there.
  std::string Install(const std::string& name, const std::string& content) const {
    const std::string path = test_ / name, fresh = path + ".new";
    std::ofstream(fresh, std::ios::binary) << content;
    std::filesystem::permissions(fresh, std::filesystem::perms::owner_all);
    std::filesystem::rename(fresh, path);
    return path;
  }

  static std::string RealWorker() {
    std::ifstream file(std::filesystem::path(RILIEVOD_PROGRAM).parent_path() / "rilievo-worker",
                       std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::vector<std::string> Submit(int count) const {
    std::vector<std::string> ids;
    for (int i = 0; i < count; ++i) {
      const auto job = Client().Submit(PackScan(SphereScan(2'000)), {}, std::to_string(i));
      EXPECT_TRUE(job.ok()) << job.status();
      if (job.ok()) ids.push_back(job->job_id());
    }
    return ids;
  }

  void ExpectSuccess(const std::vector<std::string>& ids) const {
    for (const std::string& id : ids) {
      const auto job = Client().Watch(id);
      ASSERT_TRUE(job.ok()) << job.status();
      EXPECT_EQ(job->state(), v1::JOB_STATE_SUCCEEDED) << job->error().message();
      EXPECT_EQ(job->attempts(), 1u);
    }
  }

  bool WaitForHealth(HealthCheckResponse::ServingStatus expected) const {
    const auto stub = grpc::health::v1::Health::NewStub(Channel());
    const auto end = std::chrono::steady_clock::now() + seconds(10);
    while (std::chrono::steady_clock::now() < end) {
      grpc::ClientContext context;
      grpc::health::v1::HealthCheckRequest request;
      request.set_service(v1::JobsService::service_full_name());
      HealthCheckResponse response;
      if (stub->Check(&context, request, &response).ok() && response.status() == expected) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return false;
  }
};

TEST_F(MachineTroubleTest, AnUpgradeUnderARunningServerLosesNoJob) {
  const std::string program = Install("worker", RealWorker());
  StartServer({"--worker", program});
  ExpectSuccess(Submit(1));
  Install("worker", "not even a program");
  ExpectSuccess(Submit(5));
  std::filesystem::remove(program);
  ExpectSuccess(Submit(6));
}

TEST_F(MachineTroubleTest, AWorkerThatCannotStartDelaysJobsAndFailsNone) {
  Install("real", RealWorker());
  const std::string repaired = test_ / "repaired";
  const std::string program = Install(
      "worker", "#!/bin/sh\n[ -e " + repaired + " ] || exit 127\nexec " + (test_ / "real") + "\n");
  StartServer({"--worker", program});
  EXPECT_TRUE(WaitForHealth(HealthCheckResponse::SERVING));
  const std::vector<std::string> ids = Submit(2);
  EXPECT_TRUE(WaitForHealth(HealthCheckResponse::NOT_SERVING));
  EXPECT_TRUE(daemon_->WaitForLine("UNAVAILABLE: the worker ended with code 127", seconds(5)));
  // A call that cannot wait for ever is told at its turn.
  const absl::Status refused =
      ReconstructionClient(Channel()).Reconstruct(SphereScan(2'000), {}).status();
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  for (const std::string& id : ids) {
    const v1::Job job = *Client().Get(id);
    EXPECT_TRUE(job.state() == v1::JOB_STATE_QUEUED || job.state() == v1::JOB_STATE_RUNNING);
  }
  std::ofstream(repaired) << "yes";
  ExpectSuccess(ids);
  EXPECT_TRUE(WaitForHealth(HealthCheckResponse::SERVING));
}

TEST_F(MachineTroubleTest, NoHandlesIsNoJobsFault) {
  StartServer();
  ExpectSuccess(Submit(1));
  // Connected while there are handles; asks once, for there are none until it was answered.
  const JobsClient client = HastyClient();
  ASSERT_TRUE(client.List(1).ok());
  std::vector<std::string> ids;
  for (int free = 1; free <= 4; ++free) {
    rlimit before{};
    ASSERT_EQ(prlimit(daemon_->pid(), RLIMIT_NOFILE, nullptr, &before), 0);
    const auto open = std::distance(
        std::filesystem::directory_iterator("/proc/" + std::to_string(daemon_->pid()) + "/fd"), {});
    const rlimit few{static_cast<rlim_t>(open + free), before.rlim_max};
    ASSERT_EQ(prlimit(daemon_->pid(), RLIMIT_NOFILE, &few, nullptr), 0);
    v1::CreateJobRequest request;
    const PackedScan scan = PackScan(SphereScan(2'000));
    request.set_request_id("few-" + std::to_string(free));
    request.set_scan_id(scan.scan_id);
    request.mutable_header()->set_point_count(scan.header.point_count());
    request.mutable_header()->set_coordinate_format(scan.header.coordinate_format());
    const auto job = client.Create(request);
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    ASSERT_EQ(prlimit(daemon_->pid(), RLIMIT_NOFILE, &before, nullptr), 0);
    if (job.ok()) ids.push_back(job->job_id());
  }
  EXPECT_FALSE(ids.empty());
  ExpectSuccess(ids);
}

TEST_F(MachineTroubleTest, AScanThatChangedOnDiskFailsItsJobAndIsUploadedAgain) {
  StartServer();
  const PackedScan scan = PackScan(SphereScan(2'000));
  ExpectSuccess({Client().Submit(scan, {}, "sound")->job_id()});
  {
    std::fstream blob(test_ / ("store/blobs/" + scan.scan_id),
                      std::ios::in | std::ios::out | std::ios::binary);
    blob.seekp(5'000);
    blob.put('?');
    ASSERT_TRUE(blob.good());
  }
  const auto job = Client().Watch(Client().Submit(scan, {}, "damaged")->job_id());
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::JOB_STATE_FAILED);
  EXPECT_EQ(job->error().code(), static_cast<int>(absl::StatusCode::kDataLoss));
  EXPECT_THAT(job->error().message(), testing::HasSubstr("upload it again"));
  ExpectSuccess({Client().Submit(scan, {}, "healed")->job_id()});
}

}  // namespace
}  // namespace rilievo
