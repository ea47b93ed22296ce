// A mesh on its way through Reconstruct and through JobsService, on a real socket.
#include "client/library/jobs_client.h"
#include "client/library/reconstruction_client.h"
#include "tests/integration/service/service_fixture.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

v1::ReconstructRequest MeshHeaderRequest(uint64_t points, uint64_t triangles) {
  v1::ReconstructRequest request = HeaderRequest(points);
  request.mutable_header()->set_triangle_count(triangles);
  return request;
}

// More than one message of each kind.
PointCloud LargeMesh() {
  PointCloud mesh;
  mesh.points = Eigen::Matrix3Xd::Random(3, 50'000);
  mesh.triangles.resize(3, 90'000);
  for (int i = 0; i < 270'000; ++i) mesh.triangles.data()[i] = (i * 7) % 50'000;
  return mesh;
}

class MeshCallTest : public ServiceTest {
 protected:
  ~MeshCallTest() override { server_.reset(); }

  Outcome Call(const std::vector<v1::ReconstructRequest>& requests) {
    grpc::ClientContext context;
    const auto stream = NewStub()->Reconstruct(&context);
    for (const auto& request : requests) {
      if (!stream->Write(request)) break;
    }
    stream->WritesDone();
    return ReadToEnd(stream.get());
  }

  TestFolder test_;
};

TEST_F(MeshCallTest, TheLibrarySendsTrianglesAfterThePoints) {
  StartServer();
  const PointCloud mesh = LargeMesh();
  const auto result = ReconstructionClient(NewChannel()).Reconstruct(mesh, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(work_.last_point_count(), 50'000);
  EXPECT_EQ(work_.last_triangles(), mesh.triangles);
  ASSERT_TRUE(server_->WaitUntilIdle(std::chrono::seconds(5)));
  const std::lock_guard lock(log_mutex_);
  EXPECT_EQ(log_.at(0).bytes_in, 50'000 * 24 + 90'000 * 12);
}

TEST_F(MeshCallTest, AKeptJobHasThemToo) {
  ServerOptions options;
  options.store = test_ / "store";
  StartServer(options);
  const PointCloud mesh = LargeMesh();
  const JobsClient client(NewChannel(), {.attempts = 1});
  const auto job = client.Submit(PackScan(mesh), {}, "mesh");
  ASSERT_TRUE(job.ok()) << job.status();
  ASSERT_EQ(client.Watch(job->job_id())->state(), v1::JOB_STATE_SUCCEEDED);
  EXPECT_EQ(work_.last_point_count(), 50'000);
  EXPECT_EQ(work_.last_triangles(), mesh.triangles);
}

TEST_F(MeshCallTest, AStoredScanOfOtherCountsIsRefused) {
  ServerOptions options;
  options.store = test_ / "store";
  StartServer(options);
  PackedScan packed = PackScan(LargeMesh());
  packed.header.set_triangle_count(89'999);
  const auto job = JobsClient(NewChannel(), {.attempts = 1}).Submit(packed, {}, "mesh");
  EXPECT_EQ(job.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(job.status().message()),
              HasSubstr("header.point_count: these points and triangles take 2279988 bytes"));
}

TEST_F(MeshCallTest, RefusesTrianglesOutOfTurn) {
  StartServer();
  const auto mesh = MeshHeaderRequest(3, 2);
  const std::vector<std::pair<std::vector<v1::ReconstructRequest>, std::string>> cases = {
      {{HeaderRequest(20), PointsRequest(20), TrianglesRequest(1)}, "triangles"},
      {{mesh, TrianglesRequest(2)}, "triangles"},
      {{mesh, PointsRequest(2), TrianglesRequest(2)}, "triangles"},
      {{mesh, PointsRequest(3), TrianglesRequest(1), PointsRequest(1)}, "points"},
      {{mesh, PointsRequest(3), v1::ReconstructRequest()}, "points"},
  };
  for (const auto& [requests, field] : cases) {
    const Outcome outcome = Call(requests);
    EXPECT_EQ(Reason(outcome.status), "MESSAGE_ORDER") << outcome.status.error_message();
    EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre(field));
  }
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(MeshCallTest, RefusesMoreAndFewerTrianglesThanAnnounced) {
  StartServer();
  const auto mesh = MeshHeaderRequest(3, 2);
  const Outcome more = Call({mesh, PointsRequest(3), TrianglesRequest(3)});
  EXPECT_EQ(Reason(more.status), "INVALID_FIELD");
  EXPECT_THAT(ViolatedFields(more.status), ElementsAre("triangles.data"));
  const Outcome fewer = Call({mesh, PointsRequest(3), TrianglesRequest(1)});
  EXPECT_EQ(Reason(fewer.status), "SCAN_INCOMPLETE");
  EXPECT_THAT(fewer.status.error_message(), HasSubstr("1 of 2 announced triangles"));
  EXPECT_EQ(work_.begun(), 0);
  EXPECT_TRUE(Call({mesh, PointsRequest(3), TrianglesRequest(2)}).status.ok());
}

TEST_F(MeshCallTest, TrianglesAtFaultAreNamed) {
  work_.answer = absl::InvalidArgumentError("triangles: triangle 0 names vertex 7 of 3");
  StartServer();
  const Outcome outcome = Call({MeshHeaderRequest(3, 1), PointsRequest(3), TrianglesRequest(1)});
  EXPECT_EQ(Reason(outcome.status), "UNUSABLE_SCAN");
  EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("triangles"));
  EXPECT_EQ(outcome.status.error_message(), "triangles: triangle 0 names vertex 7 of 3");
}

}  // namespace
}  // namespace rilievo
