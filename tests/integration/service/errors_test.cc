// Each RPC called wrongly in each way that the protocol documents: every error tells its reason.
#include <filesystem>
#include <fstream>
#include <regex>
#include <thread>

#include "core/codec/container/dss.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "server/auth/access_tokens.h"
#include "tests/integration/auth/every_rpc.h"
#include "tests/integration/service/errors_fixture.h"

namespace rilievo {
namespace {

using std::chrono::milliseconds;

// "Rpc REASON" of all that the comments of the protocol say of single RPCs.
std::set<std::string> Documented() {
  std::set<std::string> pairs;
  for (const char* name : {"reconstruction", "jobs"}) {
    std::ifstream file(std::string(RILIEVO_SOURCE_FOLDER "/proto/rilievo/v1/") + name + ".proto");
    std::string comment;
    for (std::string line; std::getline(file, line);) {
      std::smatch rpc;
      if (line.rfind("  //", 0) == 0) {
        comment += line;
      } else if (std::regex_search(line, rpc, std::regex("^  rpc (\\w+)"))) {
        for (const ErrorCauseEntry& entry : ErrorCauses()) {
          if (std::regex_search(comment, std::regex(std::string("\\b") + entry.name + "\\b"))) {
            pairs.insert(rpc[1].str() + " " + entry.name);
          }
        }
        comment.clear();
      } else {
        comment.clear();
      }
    }
  }
  return pairs;
}

class DocumentedErrorsTest : public ErrorsTest {
 protected:
  void WrongRequests();
  void WrongUploads();
  void FailingWork();
  void FullServers();
  void SlowClients();
  void EndingServers();
  void BrokenStores();
};

void DocumentedErrorsTest::WrongRequests() {
  ServerOptions options;
  options.max_points = 1000;
  Start(options);
  Expect("Reconstruct", "INVALID_FIELD", Reconstruct({HeaderRequest(5)}));
  Expect("Reconstruct", "LIMIT_EXCEEDED", Reconstruct({HeaderRequest(2000)}));
  Expect("Reconstruct", "MESSAGE_ORDER", Reconstruct({PointsRequest(20)}));
  Expect("Reconstruct", "MESSAGE_ORDER", Reconstruct({}));
  Expect("Reconstruct", "MESSAGE_ORDER", Reconstruct({HeaderRequest(20), HeaderRequest(20)}));
  Expect("Reconstruct", "MESSAGE_ORDER", Reconstruct({HeaderRequest(20), TrianglesRequest(1)}));
  Expect("Reconstruct", "SCAN_INCOMPLETE", Reconstruct({HeaderRequest(50), PointsRequest(20)}));

  const std::string scan = UploadedScan();
  Expect("CreateJob", "INVALID_FIELD", Create("a/b", scan));
  Expect("CreateJob", "INVALID_FIELD", Create("a", "no scan"));
  Expect("CreateJob", "INVALID_FIELD", Create("a", scan, [](auto* h) { h->set_point_count(21); }));
  Expect("CreateJob", "INVALID_FIELD",
         Create("a", scan, [](auto* h) { h->set_triangle_count(1); }));
  Expect("CreateJob", "LIMIT_EXCEEDED",
         Create("a", scan, [](auto* h) { h->set_point_count(2000); }));
  Expect("CreateJob", "SCAN_NOT_FOUND", Create("a", std::string(64, 'a')));
  ASSERT_TRUE(Create("a", scan).ok());
  const std::string job = job_id_;
  Expect("CreateJob", "REQUEST_ID_USED",
         Create("a", scan, [](auto* h) { h->mutable_options()->set_seed(7); }));
  using Jobs = v1::JobsService::Stub;
  Expect("GetUpload", "INVALID_FIELD",
         Ask<v1::GetUploadResponse>(&Jobs::GetUpload, v1::GetUploadRequest()));
  Expect("GetJob", "JOB_NOT_FOUND", Ask<v1::GetJobResponse>(&Jobs::GetJob, v1::GetJobRequest()));
  v1::ListJobsRequest list;
  list.set_page_token("x");
  Expect("ListJobs", "INVALID_FIELD", Ask<v1::ListJobsResponse>(&Jobs::ListJobs, list));
  Expect("CancelJob", "JOB_NOT_FOUND",
         Ask<v1::CancelJobResponse>(&Jobs::CancelJob, v1::CancelJobRequest()));
  Expect("DeleteJob", "JOB_NOT_FOUND",
         Ask<v1::DeleteJobResponse>(&Jobs::DeleteJob, v1::DeleteJobRequest()));
  v1::DeleteScanRequest deletion;
  Expect("DeleteScan", "INVALID_FIELD", Ask<v1::DeleteScanResponse>(&Jobs::DeleteScan, deletion));
  deletion.set_scan_id(std::string(64, 'a'));
  Expect("DeleteScan", "SCAN_NOT_FOUND", Ask<v1::DeleteScanResponse>(&Jobs::DeleteScan, deletion));
  Expect("WatchJob", "JOB_NOT_FOUND", Watch("none"));
  Expect("StreamSurface", "JOB_NOT_FOUND", Stream("none"));
  ASSERT_TRUE(Watch(job).ok());
  Expect("StreamSurface", "OFFSET_OUT_OF_RANGE", Stream(job, 1'000'000'000));
  Expect("StreamSurface", "OFFSET_OUT_OF_RANGE", Stream(job, 0, /*chunk=*/true));
  for (const auto& blob : std::filesystem::directory_iterator(store_ + "/blobs")) {
    std::filesystem::resize_file(blob.path(), 1);
  }
  Expect("StreamSurface", "SURFACE_DAMAGED", Stream(job));
}

void DocumentedErrorsTest::WrongUploads() {
  ServerOptions options;
  options.max_scan_bytes = 3 << 20;
  Start(options);
  Expect("UploadScan", "INVALID_FIELD", Upload({UploadHeaderOf("a/b", 9)}));
  Expect("UploadScan", "INVALID_FIELD", Upload({UploadHeaderOf("a", 9), Chunk("ten bytes!")}));
  Expect("UploadScan", "LIMIT_EXCEEDED", Upload({UploadHeaderOf("a", 4 << 20)}));
  Expect("UploadScan", "LIMIT_EXCEEDED",
         Upload({UploadHeaderOf("a", 3 << 20), Chunk(std::string(2 << 20, 'x'))}));
  Expect("UploadScan", "MESSAGE_ORDER", Upload({Chunk("x")}));
  Expect("UploadScan", "MESSAGE_ORDER", Upload({UploadHeaderOf("a", 9), UploadHeaderOf("a", 9)}));
  Expect("UploadScan", "OFFSET_OUT_OF_RANGE", Upload({UploadHeaderOf("b", 9, 5)}));
  Expect("UploadScan", "SCAN_INCOMPLETE", Upload({UploadHeaderOf("a", 9), Chunk("x")}));
  Expect("UploadScan", "SCAN_MISMATCH", Upload({UploadHeaderOf("a", 9), Chunk("x"), EndOf("y")}));

  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto first = jobs_->UploadScan(&context, &response);
  first->Write(UploadHeaderOf("c", 9));
  while (!std::filesystem::exists(store_ + "/uploads/c")) {
    std::this_thread::sleep_for(milliseconds(5));
  }
  Upload({UploadHeaderOf("c", 9), Chunk("x")});
  first->Write(Chunk("x"));
  Expect("UploadScan", "UPLOAD_TAKEN_OVER", first->Finish());
}

// The .dss file of a tetrahedron at level 1, away from the origin.
std::string FarSurface() {
  DisplacedSurface surface;
  surface.frame = {Eigen::Vector3d(50, 50, 50), 1};
  surface.control_mesh.vertices.resize(3, 4);
  surface.control_mesh.vertices << 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5;
  surface.control_mesh.faces.resize(3, 4);
  surface.control_mesh.faces << 0, 0, 0, 1, 2, 1, 3, 2, 1, 3, 2, 3;
  EncodeOptions options;
  options.position_step = 1e-3;
  surface.control_mesh = *PrepareControlMesh(surface.control_mesh, options.position_step);
  surface.max_level = 1;
  surface.heights.assign(10, 0.0F);
  surface.sources.assign(10, HeightSource::kMeasured);
  const std::vector<uint8_t> dss = EncodeDss(surface, {}, options, {})->Concatenate();
  return {dss.begin(), dss.end()};
}

void DocumentedErrorsTest::FailingWork() {
  using absl::StatusCode;
  const std::vector<std::pair<StatusCode, std::string>> failures = {
      {StatusCode::kInvalidArgument, "UNUSABLE_SCAN"},
      {StatusCode::kFailedPrecondition, "UNSUITABLE_TOPOLOGY"},
      {StatusCode::kAborted, "WORKER_KILLED"},
      {StatusCode::kResourceExhausted, "JOB_TOO_LARGE"},
      {StatusCode::kUnknown, "SERVER_DEFECT"}};
  for (const auto& [code, reason] : failures) {
    work_.answer = absl::Status(code, "as the stage said");
    Start();
    Expect("Reconstruct", reason, Reconstruct({HeaderRequest(20), PointsRequest(20)}));
    if (code == StatusCode::kAborted) continue;  // a kept job is tried again
    ASSERT_TRUE(Create("a", UploadedScan()).ok());
    ASSERT_TRUE(Watch(job_id_).ok());
    ExpectReason(reason, last_event_.job().error());
    Expect("StreamSurface", "JOB_NOT_SUCCEEDED", Stream(job_id_));
  }
  const std::string far = FarSurface();
  v1::ReconstructRequest update = HeaderRequest(20), base;
  update.mutable_header()->mutable_base_surface()->set_bytes(far.size());
  update.mutable_header()->mutable_base_surface()->set_vertices(10);
  base.mutable_base()->set_data(far);
  Start();
  Expect("Reconstruct", "UNSUITABLE_BASE", Reconstruct({update, PointsRequest(20), base}));
  work_.answer = absl::UnavailableError("no worker");  // a kept job waits until there is one
  Start();
  Expect("Reconstruct", "WORKER_UNAVAILABLE", Reconstruct({HeaderRequest(20), PointsRequest(20)}));
  work_.answer.reset();
}

void DocumentedErrorsTest::FullServers() {
  ServerOptions options;
  options.memory_budget = 1000;
  Start(options);
  const std::string scan = UploadedScan();
  Expect("Reconstruct", "MEMORY_LIMIT", Reconstruct({HeaderRequest(20)}));
  Expect("CreateJob", "MEMORY_LIMIT", Create("a", scan));
  // By parts, on a disk that has no room left.
  options.scratch = test_ / "scratch";
  options.part_points = 2048;
  options.memory_budget = 90'000'000;
  std::filesystem::create_directory(options.scratch);
  Start(options);
  std::filesystem::remove(options.scratch);
  std::filesystem::create_directory_symlink("/proc", options.scratch);
  v1::ReconstructRequest large = HeaderRequest(20);
  large.mutable_header()->mutable_options()->set_max_level(7);
  Expect("Reconstruct", "STORE_FULL", Reconstruct({large, PointsRequest(20)}));
  Expect("CreateJob", "STORE_FULL",
         Create("a", UploadedScan(), [](auto* h) { h->mutable_options()->set_max_level(7); }));
  options = {};
  options.keep_bytes = 100;
  Start(options);
  Expect("UploadScan", "STORE_FULL", Upload({UploadHeaderOf("a", 9000)}));

  options = {};
  options.max_uploads = options.max_waiting_jobs = options.max_concurrent_jobs = 1;
  options.max_queued_jobs = 0;
  for (const bool calls : {false, true}) {
    options.max_calls = calls ? 1 : 8;
    work_.wait = true;
    Start(options);
    ASSERT_TRUE(calls || Create("a", UploadedScan()).ok());
    grpc::ClientContext context;
    v1::UploadScanResponse response;
    const auto held = jobs_->UploadScan(&context, &response);
    held->Write(UploadHeaderOf("held", 9));
    while (!std::filesystem::exists(store_ + "/uploads/held")) {
      std::this_thread::sleep_for(milliseconds(5));
    }
    const std::string reason = calls ? "CALLS_LIMIT" : "JOBS_LIMIT";
    Expect("UploadScan", reason, Upload({UploadHeaderOf("a", 9)}));
    if (calls) {
      Expect("Reconstruct", reason, Reconstruct({HeaderRequest(20)}));
      Expect("WatchJob", reason, Watch("a"));
      Expect("StreamSurface", reason, Stream("a"));
    } else {
      Expect("CreateJob", reason, Create("b", ContentNameOf(std::string(kScanBytes, '\0'))));
      grpc::ClientContext waiting;
      const auto stream = NewStub()->Reconstruct(&waiting);
      stream->Write(HeaderRequest(20));
      // Takes the only place once its header was read.
      grpc::Status status;
      do {
        status = Reconstruct({HeaderRequest(20)});
      } while (Reason(status) != reason);
      Expect("Reconstruct", reason, status);
      waiting.TryCancel();
    }
    context.TryCancel();
  }
  work_.wait = false;
}

void DocumentedErrorsTest::SlowClients() {
  ServerOptions options;
  options.max_idle_time = milliseconds(200);
  Start(options);
  Expect("Reconstruct", "IDLE_LIMIT", Reconstruct({HeaderRequest(20)}, /*open=*/true));
  Expect("UploadScan", "IDLE_LIMIT", Upload({UploadHeaderOf("a", 9)}, /*open=*/true));
  options = {};
  options.max_job_time = milliseconds(200);
  Start(options);
  Expect("Reconstruct", "UPLOAD_TIME_LIMIT", Reconstruct({HeaderRequest(20)}, /*open=*/true));
  Expect("UploadScan", "UPLOAD_TIME_LIMIT", Upload({UploadHeaderOf("a", 9)}, /*open=*/true));
  work_.wait = true;
  Expect("Reconstruct", "JOB_TIME_LIMIT", Reconstruct({HeaderRequest(20), PointsRequest(20)}));
  work_.wait = false;
}

void DocumentedErrorsTest::EndingServers() {
  work_.wait = true;
  Start();
  const std::string scan = UploadedScan();
  ASSERT_TRUE(Create("a", scan).ok());
  const std::string job = job_id_;
  server_->BeginDrain();
  Expect("Reconstruct", "SHUTTING_DOWN", Reconstruct({HeaderRequest(20)}));
  Expect("UploadScan", "SHUTTING_DOWN", Upload({UploadHeaderOf("a", 9)}));
  Expect("CreateJob", "SHUTTING_DOWN", Create("b", scan));
  Expect("WatchJob", "SHUTTING_DOWN", Watch(job));
  work_.wait = false;
}

void DocumentedErrorsTest::BrokenStores() {
  Start();
  std::filesystem::remove_all(store_ + "/uploads");
  Expect("UploadScan", "STORE_FAILED", Upload({UploadHeaderOf("a", 9)}));
}

TEST_F(DocumentedErrorsTest, EveryOneComesWithItsReason) {
  WrongRequests();
  WrongUploads();
  FullServers();
  SlowClients();
  BrokenStores();
  FailingWork();
  EndingServers();
  std::set<std::string> missing;
  for (const std::string& pair : Documented()) {
    if (!seen_.contains(pair)) missing.insert(pair);
  }
  // Who cancels does not read the answer.
  EXPECT_THAT(missing, testing::ElementsAre("Reconstruct CLIENT_CANCELLED"));
}

TEST_F(ErrorsTest, EveryRpcTellsWhoMayCallAndWhatItTakes) {
  StartServer();
  for (const auto& [rpc, status] : CallEveryRpc(NewChannel())) {
    if (rpc.find("JobsService") != std::string::npos) Expect(rpc, "NO_STORE", status);
  }
  Start();
  for (const auto& [rpc, status] : CallEveryRpc(NewChannel(), "\xff\xff\xff")) {
    Expect(rpc, "MALFORMED_MESSAGE", status);
  }
  for (const char* unknown : {"/rilievo.v1.JobsService/GetJobs", "/other.Service/Method"}) {
    Expect(unknown, "UNKNOWN_METHOD", CallByName(NewChannel(), unknown));
  }
  ServerOptions options;
  options.tokens = test_ / "tokens";
  std::ofstream(options.tokens) << MakeToken("ann")->line << "\n";
  Start(options);
  for (const auto& [rpc, status] : CallEveryRpc(NewChannel())) Expect(rpc, "NO_TOKEN", status);
  for (const auto& [rpc, status] : CallEveryRpc(NewChannel(), "", "Bearer ann.x")) {
    Expect(rpc, "WRONG_TOKEN", status);
  }
}

// Who does not read gets the code and the words; details would wait behind the surface.
TEST_F(ErrorsTest, ASlowReaderIsToldWhy) {
  work_.chunk_sizes = {1000, 40'000'000};
  ServerOptions options;
  options.max_idle_time = milliseconds(500);
  Start(options);
  ASSERT_TRUE(Create("a", UploadedScan()).ok());
  ASSERT_TRUE(Watch(job_id_).ok());
  grpc::ClientContext kept, direct;
  v1::StreamSurfaceRequest request;
  request.set_job_id(job_id_);
  const auto surface = jobs_->StreamSurface(&kept, request);
  const auto stream = NewStub()->Reconstruct(&direct);
  SendWholeScan(stream.get(), 20);
  std::this_thread::sleep_for(milliseconds(2500));
  v1::StreamSurfaceResponse response;
  while (surface->Read(&response)) {
  }
  for (const grpc::Status& status : {surface->Finish(), ReadToEnd(stream.get()).status}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    EXPECT_THAT(status.error_message(), testing::HasSubstr("no message passed for 0.5 s"));
  }
}

TEST(ErrorCauses, AreThoseOfTheDocumentation) {
  std::ifstream file(RILIEVO_SOURCE_FOLDER "/docs/api.md");
  std::set<std::string> documented, known;
  bool table = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("<!-- reasons:", 0) == 0) table = line.find("begin") != std::string::npos;
    if (!table) continue;
    const std::regex cell("^\\| `([A-Z_]+)` \\| ((`[A-Z_]+`(, )?)+) \\|");
    std::smatch row;
    if (!std::regex_search(line, row, cell)) continue;
    const std::string reasons = row[2];
    const std::regex word("[A-Z_]+");
    for (std::sregex_iterator at(reasons.begin(), reasons.end(), word), end; at != end; ++at) {
      documented.insert(row[1].str() + " " + at->str());
    }
  }
  for (const ErrorCauseEntry& entry : ErrorCauses()) {
    known.insert(absl::StatusCodeToString(entry.code) + " " + entry.name);
  }
  EXPECT_EQ(documented, known);
}

}  // namespace
}  // namespace rilievo
