// Jobs that need more memory than the server gives one: made by parts, on its scratch disk.
#include <filesystem>

#include "client/library/status_conversion.h"
#include "core/paging/scan_pager.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using std::chrono::seconds;

constexpr int64_t kPartPoints = 2048;

// That take more memory than parts do, and little time.
v1::ReconstructOptions HungryOptions() {
  v1::ReconstructOptions options;
  options.mutable_fit()->set_sample_level(4);
  options.set_max_level(0);
  return options;
}

class PartsOfJobsTest : public JobsTest {
 protected:
  PartsOfJobsTest() { std::filesystem::create_directory(scratch_); }

  // Of as little memory as parts take.
  void StartSmallServer(std::vector<std::string> arguments = {}) {
    arguments.insert(arguments.end(), {"--scratch", scratch_, "--part-points",
                                       std::to_string(kPartPoints), "--memory-budget", "90000000"});
    StartServer(arguments);
  }

  static std::vector<uint8_t> ExpectedByParts(const PointCloud& scan) {
    ScanPager pager = ScanPager::Create(ScratchFolder(testing::TempDir())).value();
    EXPECT_TRUE(pager.Add(scan.points).ok());
    const PagedScan pages = pager.Finish(RunContext{}).value();
    ReconstructOptions options;
    options.fit.sample_level = 4;
    options.max_level = 0;
    return ReconstructPaged(pages, PartSizes::Of(kPartPoints), options, RunContext{})
        ->encoded.Concatenate();
  }

  const std::string scratch_ = test_ / "scratch";
};

TEST_F(PartsOfJobsTest, TheyMakeTheBytesOfOneMachineThoughTheServerBeKilled) {
  StartSmallServer();
  const PointCloud scan = SphereScan(13'000);
  const std::vector<uint8_t> expected = ExpectedByParts(scan);
  const auto job = Client().Submit(PackScan(scan), HungryOptions(), "kept");
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->part_points(), uint64_t{kPartPoints});
  ASSERT_GT(daemon_->WaitForWorker(seconds(10)), 0);
  EXPECT_TRUE(std::filesystem::is_empty(scratch_)) << "its files have no names";
  KillServer();
  StartSmallServer();
  const auto ended = Client().Watch(job->job_id());
  ASSERT_TRUE(ended.ok()) << ended.status();
  EXPECT_EQ(ended->state(), v1::JOB_STATE_SUCCEEDED) << ended->error().message();
  const auto surface = Client().Fetch(job->job_id());
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(*surface, expected);
  EXPECT_TRUE(std::filesystem::is_empty(scratch_));
}

TEST_F(PartsOfJobsTest, WithoutTheFolderTheyAreRefusedAndNoServerStarts) {
  StartSmallServer();
  std::filesystem::remove(scratch_);
  const absl::Status status =
      ReconstructionClient(Channel()).Reconstruct(SphereScan(13'000), HungryOptions()).status();
  EXPECT_EQ(ErrorReason(status), "WORKER_UNAVAILABLE");
  EXPECT_EQ(RunProgram({RILIEVOD_PROGRAM, "--scratch", scratch_}), 1);
}

}  // namespace
}  // namespace rilievo
