// The jobs room over a store in a folder, its work in the hands of the test.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/grpcpp.h"
#include "server/jobs/jobs_service.h"
#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

// Answers each attempt with the next of `answers`, then with a surface of one chunk "surface".
class FakeJobWork {
 public:
  absl::StatusOr<JobResult> Run(const RunContext& context) {
    std::unique_lock lock(mutex_);
    ++begun_;
    changed_.notify_all();
    if (wait) {
      changed_.wait(lock, context.stop, [this] { return released_; });
      if (context.stop.stop_requested()) return absl::CancelledError("stopped");
    }
    if (!answers.empty()) {
      const absl::Status answer = answers.front();
      answers.erase(answers.begin());
      return answer;
    }
    JobResult result;
    const std::string surface = "surface";
    result.encoded.chunks = {{surface.begin(), surface.end()}};
    result.report.set_road("spherical");
    return result;
  }

  void Release() {
    const std::lock_guard lock(mutex_);
    released_ = true;
    changed_.notify_all();
  }

  // Whether so many attempts have begun in time.
  bool WaitForBegun(int count, std::chrono::milliseconds time = std::chrono::seconds(10)) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return begun_ >= count; });
  }

  bool wait = false;                  // set before the first job
  std::vector<absl::Status> answers;  // likewise

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool released_ = false;
  int begun_ = 0;
};

inline std::string ReasonOf(const grpc::Status& status) {
  google::rpc::Status details;
  google::rpc::ErrorInfo info;
  details.ParseFromString(status.error_details());
  for (const auto& detail : details.details()) {
    if (detail.UnpackTo(&info)) return info.reason();
  }
  return "";
}

// The room without gRPC. Caller "" with client "c", unless told otherwise.
class JobsRoomTest : public testing::Test {
 protected:
  void Open(ServerOptions options = {}) {
    core_.reset();
    service_.reset();
    service_ = std::make_unique<ServiceCore>(
        options,
        [this](const JobRequest&, ScanBytes, const RunContext& context) {
          return work_.Run(context);
        },
        [this](const JobRecord& record) {
          const std::lock_guard lock(mutex_);
          log_.push_back(record);
        },
        std::make_unique<Doorkeeper>());
    core_ = std::make_unique<JobsCore>(service_.get(),
                                       *JobStore::Open(test_ / "store", SettingsOfStore(options)));
  }

  ~JobsRoomTest() override {
    work_.Release();
    core_.reset();
  }

  // Of 20 points; its name.
  std::string AddScan(const std::string& owner = "", size_t bytes = 20 * 12) {
    const std::string scan = *core_->store->blobs().Put({std::vector<uint8_t>(bytes, 7)});
    EXPECT_TRUE(core_->store->AddScan(owner, scan).ok());
    return scan;
  }

  static v1::CreateJobRequest Request(const std::string& request_id, const std::string& scan) {
    v1::CreateJobRequest request;
    request.set_request_id(request_id);
    request.set_scan_id(scan);
    request.mutable_header()->set_point_count(20);
    request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
    return request;
  }

  // As CreateJob keeps it.
  StoredJob Stored(const std::string& id, const std::string& owner = "") {
    StoredJob stored{.owner = owner, .client = "c"};
    stored.header = Request("r-" + id, AddScan(owner)).header();
    stored.job.set_job_id(id);
    stored.job.set_request_id("r-" + id);
    stored.job.set_scan_id(AddScan(owner));
    stored.job.set_state(v1::JOB_STATE_QUEUED);
    stored.job.set_sequence(SequenceOfState(v1::JOB_STATE_QUEUED, 0));
    EXPECT_TRUE(core_->store->Insert(stored).ok());
    return stored;
  }

  // The job when it is finished; as it is after ten seconds.
  v1::Job WaitForEnd(const std::string& id, const std::string& owner = "") {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    for (;;) {
      const auto stored = core_->store->Get(owner, id);
      if (!stored.ok() || IsFinished(stored->job.state()) ||
          std::chrono::steady_clock::now() > end) {
        return stored.ok() ? stored->job : v1::Job();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  TestFolder test_;
  FakeJobWork work_;
  std::mutex mutex_;
  std::vector<JobRecord> log_;
  std::unique_ptr<ServiceCore> service_;
  std::unique_ptr<JobsCore> core_;
};

// The service over gRPC, inside this process.
class JobsServiceTest : public testing::Test {
 protected:
  void Open(ServerOptions options = {}) {
    Close();
    if (options.store.empty()) options.store = test_ / "store";
    core_ = std::make_unique<ServiceCore>(
        options,
        [this](const JobRequest&, ScanBytes, const RunContext& context) {
          return work_.Run(context);
        },
        JobLog(), std::make_unique<Doorkeeper>());
    auto service = JobsService::Open(core_.get(), open_store_);
    ASSERT_TRUE(service.ok()) << service.status();
    service_ = *std::move(service);
    grpc::ServerBuilder builder;
    builder.RegisterService(service_.get());
    server_ = builder.BuildAndStart();
    stub_ = v1::JobsService::NewStub(server_->InProcessChannel({}));
  }

  void Close() {
    if (!server_) return;
    core_->live_calls.StopAll(StopReason::kShutdown);
    core_->live_calls.WaitUntilEmpty(std::chrono::seconds(5));
    server_->Shutdown(std::chrono::system_clock::now() + std::chrono::milliseconds(100));
    server_.reset();
    service_.reset();
    core_.reset();
  }

  ~JobsServiceTest() override {
    work_.Release();
    Close();
  }

  // Sends what is given and reads the answer. `digest` of the bytes, unless given.
  grpc::Status Upload(const std::string& id, const std::string& bytes,
                      v1::UploadScanResponse* response, std::string digest = "");

  // A job on an uploaded scan of 20 points.
  v1::Job Submit(const std::string& request_id);

  // Its events to the end.
  grpc::Status Watch(const std::string& id, uint64_t after, std::vector<v1::JobEvent>* events);

  TestFolder test_;
  OpenStore open_store_ = OpenFolder;
  FakeJobWork work_;
  std::unique_ptr<ServiceCore> core_;
  std::unique_ptr<JobsService> service_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<v1::JobsService::Stub> stub_;
};

inline grpc::Status JobsServiceTest::Upload(const std::string& id, const std::string& bytes,
                                            v1::UploadScanResponse* response, std::string digest) {
  if (digest.empty()) digest = absl::HexStringToBytes(ContentNameOf(bytes));
  grpc::ClientContext context;
  const auto stream = stub_->UploadScan(&context, response);
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id(id);
  request.mutable_header()->set_total_bytes(bytes.size());
  stream->Write(request);
  request.set_chunk(bytes);
  stream->Write(request);
  request.mutable_end()->set_total_bytes(bytes.size());
  request.mutable_end()->set_sha256(digest);
  stream->Write(request);
  stream->WritesDone();
  return stream->Finish();
}

inline v1::Job JobsServiceTest::Submit(const std::string& request_id) {
  v1::UploadScanResponse scan;
  EXPECT_TRUE(Upload("scan", std::string(20 * 12, 'x'), &scan).ok());
  v1::CreateJobRequest request;
  request.set_request_id(request_id);
  request.set_scan_id(scan.scan_id());
  request.mutable_header()->set_point_count(20);
  request.mutable_header()->set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  v1::CreateJobResponse response;
  grpc::ClientContext context;
  const grpc::Status status = stub_->CreateJob(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.job();
}

inline grpc::Status JobsServiceTest::Watch(const std::string& id, uint64_t after,
                                           std::vector<v1::JobEvent>* events) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  v1::WatchJobRequest request;
  request.set_job_id(id);
  request.set_after_sequence(after);
  const auto stream = stub_->WatchJob(&context, request);
  v1::WatchJobResponse response;
  while (stream->Read(&response)) events->push_back(response.event());
  return stream->Finish();
}

}  // namespace rilievo
