// Several servers that do the parts of one large job.
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <span>

#include "core/base/status_macros.h"
#include "core/paging/scan_pager.h"
#include "server/postgres/postgres_database.h"
#include "server/worker/in_worker_process.h"
#include "tests/integration/parts/long_strip.h"
#include "tests/unit/server/jobs/fleet_fixture.h"

namespace rilievo {
namespace {

constexpr PartStep kStep = PartStep::kHeights;
constexpr int kParts = 4;

// Of a step of four parts, whose bytes are their numbers. Each is work of the test's.
absl::Status MakeParts(FakeJobWork* work, SharedParts* shared, const RunContext& context) {
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const SharedParts::Turn turn, shared->Next(kStep, kParts));
    if (!turn.part) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(JobResult result, work->Run(context));
    std::vector<uint8_t> bytes = {static_cast<uint8_t>('0' + *turn.part)};
    RILIEVO_RETURN_IF_ERROR(shared->Keep(
        kStep, *turn.part, [&, told = false]() mutable -> absl::StatusOr<std::span<const uint8_t>> {
          if (std::exchange(told, true)) bytes.clear();
          return bytes;
        }));
  }
}

// What came of all.
absl::StatusOr<JobResult> SurfaceOf(SharedParts* shared) {
  JobResult result;
  if (!shared->leads()) return result;
  std::vector<uint8_t>& surface = result.encoded.chunks.emplace_back();
  for (int part = 0; part < kParts; ++part) {
    RILIEVO_RETURN_IF_ERROR(shared->Fetch(kStep, part, [&](std::span<const uint8_t> piece) {
      surface.insert(surface.end(), piece.begin(), piece.end());
      return absl::OkStatus();
    }));
  }
  return result;
}

absl::StatusOr<JobResult> DoParts(FakeJobWork* work, const JobRequest& job, ScanBytes /*points*/,
                                  const RunContext& context) {
  SharedParts* const shared = job.parts->shared.get();
  RILIEVO_RETURN_IF_ERROR(MakeParts(work, shared, context));
  return SurfaceOf(shared);
}

class FleetPartsTest : public FleetTest {
 protected:
  FleetPartsTest() { do_parts_ = DoParts; }

  static const std::string& Many() {
    static const std::string bytes(13'000 * 12, 'x');
    return bytes;
  }

  // A job that is made by parts though it would fit into memory; its name.
  std::string KeepLarge(const std::string& points) {
    const auto store = *OpenPostgresStore(url_, "", {});
    StoredJob large;
    large.client = "c";
    large.header.set_point_count(points.size() / 12);
    large.header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
    v1::ReconstructOptions* options = large.header.mutable_options();
    options->mutable_control()->set_control_faces(200);
    options->mutable_fit()->set_rounds(1);
    options->set_max_level(0);
    options->set_measure(false);
    large.job.set_job_id("large");
    large.job.set_request_id("large");
    large.job.set_scan_id(*store->blobs().Put({{points.begin(), points.end()}}));
    large.job.set_part_points(2048);
    large.job.set_state(v1::JOB_STATE_QUEUED);
    EXPECT_TRUE(store->AddScan("", large.job.scan_id()).ok());
    EXPECT_TRUE(store->Insert(large).ok());
    return "large";
  }
};

// The processes of a program that this one has started.
std::vector<pid_t> ChildrenNamed(const std::string& name) {
  std::vector<pid_t> found;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream children(task.path() / "children");
    for (pid_t child; children >> child;) {
      std::string comm;
      std::ifstream("/proc/" + std::to_string(child) + "/comm") >> comm;
      if (comm == name) found.push_back(child);
    }
  }
  return found;
}

TEST_F(FleetPartsTest, WhoHasNothingElseToDoHelpsWithALargeJob) {
  const auto leader = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(leader.get(), "large", Many());
  ASSERT_TRUE(leader->work.WaitForBegun(1));
  const auto helper = Join(/*serve_only=*/false);
  PostgresDatabase database(url_);
  const char* const kDone = "SELECT COUNT(*) FROM job_parts WHERE result <> ''";
  for (int i = 0; i < 1000 && *database.Number(kDone) < 3; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(helper->work.WaitForBegun(3)) << "of four parts all but the leader's";
  leader->work.Release();
  const v1::Job done = WaitForState(helper.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.error().message();
  EXPECT_EQ(absl::BytesToHexString(done.surface().sha256()), ContentNameOf("0123"));
  EXPECT_EQ(done.attempts(), 1u);
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM job_parts"), 0);
  Created(leader.get(), "next");
  EXPECT_TRUE(leader->work.WaitForBegun(2) || helper->work.WaitForBegun(4)) << "both are free";
}

TEST_F(FleetPartsTest, ACancelStopsThoseWhoHelp) {
  const auto leader = Join(/*serve_only=*/false, /*wait=*/true);
  const std::string id = Created(leader.get(), "large", Many());
  ASSERT_TRUE(leader->work.WaitForBegun(1));
  const auto helper = Join(/*serve_only=*/false, /*wait=*/true);
  ASSERT_TRUE(helper->work.WaitForBegun(1));
  v1::CancelJobRequest request;
  request.set_job_id(id);
  v1::CancelJobResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(leader->stub->CancelJob(&context, request, &response).ok());
  for (const char* next : {"a", "b"}) Created(leader.get(), next);
  EXPECT_TRUE(leader->work.WaitForBegun(2));
  EXPECT_TRUE(helper->work.WaitForBegun(2));
}

TEST_F(FleetPartsTest, APartThatIsLostIsDoneAgainAndTheScanStays) {
  PostgresDatabase database(url_);
  std::atomic<int> attempts = 0;
  do_parts_ = [&](FakeJobWork* work, const JobRequest& job, ScanBytes,
                  const RunContext& context) -> absl::StatusOr<JobResult> {
    SharedParts* const shared = job.parts->shared.get();
    RILIEVO_RETURN_IF_ERROR(MakeParts(work, shared, context));
    if (++attempts == 1) {
      EXPECT_TRUE(database
                      .Execute("DELETE FROM parts WHERE name = (SELECT result FROM job_parts WHERE"
                               " part = 2)")
                      .ok());
    }
    return SurfaceOf(shared);
  };
  const auto worker = Join(/*serve_only=*/false);
  const std::string id = Created(worker.get(), "large", Many());
  const v1::Job done = WaitForState(worker.get(), id, v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(absl::BytesToHexString(done.surface().sha256()), ContentNameOf("0123"));
  EXPECT_EQ(attempts, 2);
  EXPECT_EQ(*database.Number("SELECT COUNT(*) FROM scans"), 1);
}

// Whoever works at a moment is killed, twice.
TEST_F(FleetPartsTest, ThoughProcessesBeKilledTheBytesAreThoseOfOne) {
  const Eigen::Matrix3Xf strip = LongStrip(24'000).cast<float>();
  ScanPager pager = ScanPager::Create(testing::TempDir()).value();
  ASSERT_TRUE(pager.Add(strip.cast<double>()).ok());
  ReconstructOptions options;
  options.control.target_faces = 200;
  options.fit.rounds = 1;
  options.max_level = 0;
  options.measure = false;
  const PagedScan pages = pager.Finish(RunContext{}).value();
  std::string alone;
  const auto expected = ReconstructPaged(pages, PartSizes::Of(2048), options, RunContext{});
  for (const auto& chunk : expected->encoded.chunks) alone.append(chunk.begin(), chunk.end());

  do_parts_ = [real = InWorkerProcess({.program = RILIEVO_WORKER}).value()](
                  FakeJobWork*, const JobRequest& job, ScanBytes points,
                  const RunContext& context) { return real(job, std::move(points), context); };
  const auto one = Join(/*serve_only=*/false), two = Join(/*serve_only=*/false);
  const std::string id = KeepLarge(
      std::string(reinterpret_cast<const char*>(strip.data()), strip.size() * sizeof(float)));
  for (int i = 0; i < 2; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
    for (const pid_t worker : ChildrenNamed("rilievo-worker")) kill(worker, SIGKILL);
  }
  std::vector<v1::JobEvent> events;
  ASSERT_TRUE(Watch(two.get(), id, 0, &events).ok());
  const v1::Job done = Get(two.get(), id);
  ASSERT_EQ(done.state(), v1::JOB_STATE_SUCCEEDED) << done.error().message();
  EXPECT_EQ(absl::BytesToHexString(done.surface().sha256()), ContentNameOf(alone));
}

}  // namespace
}  // namespace rilievo
