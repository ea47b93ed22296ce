// Calls of every RPC, right and wrong, against a server with a store; each error must tell its
// reason.
#pragma once

#include <algorithm>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "rilievo/v1/jobs.grpc.pb.h"
#include "server/conversion/error_cause.h"
#include "server/store/content_name.h"
#include "tests/integration/service/service_fixture.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

inline constexpr size_t kScanBytes = 20 * 12;

inline v1::UploadScanRequest UploadHeaderOf(const std::string& id, uint64_t bytes,
                                            uint64_t offset = 0) {
  v1::UploadScanRequest request;
  request.mutable_header()->set_upload_id(id);
  request.mutable_header()->set_total_bytes(bytes);
  request.mutable_header()->set_offset(offset);
  return request;
}

inline v1::UploadScanRequest Chunk(const std::string& bytes) {
  v1::UploadScanRequest request;
  request.set_chunk(bytes);
  return request;
}

inline v1::UploadScanRequest EndOf(const std::string& bytes) {
  v1::UploadScanRequest request;
  request.mutable_end()->set_total_bytes(bytes.size());
  request.mutable_end()->set_sha256(absl::HexStringToBytes(ContentNameOf(bytes)));
  return request;
}

class ErrorsTest : public ServiceTest {
 protected:
  ~ErrorsTest() override {
    work_.Release();
    server_.reset();
  }

  // With a store of its own, and work as the test has set it.
  void Start(ServerOptions options = {}) {
    server_.reset();
    options.store = test_ / ("store" + std::to_string(stores_++));
    store_ = options.store;
    StartServer(options);
    jobs_ = v1::JobsService::NewStub(NewChannel());
  }

  // Exactly one ErrorInfo, of the domain and of a reason that goes with the status.
  void Expect(const std::string& rpc, const std::string& reason, const grpc::Status& status) {
    SCOPED_TRACE(rpc + " " + reason + ": " + status.error_message());
    seen_.insert(rpc + " " + reason);
    google::rpc::Status details;
    ASSERT_TRUE(details.ParseFromString(status.error_details()));
    ExpectReason(reason, details);
    EXPECT_EQ(details.code(), status.error_code());
    EXPECT_EQ(details.message(), status.error_message());
  }

  static void ExpectReason(const std::string& reason, const google::rpc::Status& details) {
    int found = 0;
    google::rpc::ErrorInfo info;
    for (const auto& detail : details.details()) found += detail.UnpackTo(&info);
    EXPECT_EQ(found, 1);
    EXPECT_EQ(info.domain(), "rilievo.dev");
    EXPECT_EQ(info.reason(), reason);
    const auto entries = ErrorCauses();
    const auto entry = std::find_if(entries.begin(), entries.end(),
                                    [&](const auto& known) { return known.name == reason; });
    ASSERT_NE(entry, entries.end());
    EXPECT_EQ(details.code(), static_cast<int>(entry->code));
    EXPECT_FALSE(details.message().empty());
  }

  // A stream that is half-closed after `requests`, unless `open`.
  grpc::Status Reconstruct(const std::vector<v1::ReconstructRequest>& requests, bool open = false) {
    grpc::ClientContext context;
    const auto stream = NewStub()->Reconstruct(&context);
    for (const auto& request : requests) stream->Write(request);
    if (!open) stream->WritesDone();
    return ReadToEnd(stream.get()).status;
  }

  grpc::Status Upload(const std::vector<v1::UploadScanRequest>& requests, bool open = false) {
    grpc::ClientContext context;
    v1::UploadScanResponse response;
    const auto stream = jobs_->UploadScan(&context, &response);
    for (const auto& request : requests) {
      if (!stream->Write(request)) break;
    }
    if (!open) stream->WritesDone();
    return stream->Finish();
  }

  std::string UploadedScan() {
    const std::string bytes(kScanBytes, '\0');
    EXPECT_TRUE(Upload({UploadHeaderOf("scan", kScanBytes), Chunk(bytes), EndOf(bytes)}).ok());
    return ContentNameOf(bytes);
  }

  // Of 20 points, changed by `change`.
  grpc::Status Create(const std::string& request_id, const std::string& scan,
                      const std::function<void(v1::ReconstructHeader*)>& change = {}) {
    v1::CreateJobRequest request;
    request.set_request_id(request_id);
    request.set_scan_id(scan);
    *request.mutable_header() = HeaderRequest(20).header();
    if (change) change(request.mutable_header());
    grpc::ClientContext context;
    v1::CreateJobResponse response;
    const grpc::Status status = jobs_->CreateJob(&context, request, &response);
    job_id_ = response.job().job_id();
    return status;
  }

  // Of a unary method of the stub.
  template <typename Response, typename Request>
  grpc::Status Ask(grpc::Status (v1::JobsService::Stub::*method)(grpc::ClientContext*,
                                                                 const Request&, Response*),
                   const Request& request) {
    grpc::ClientContext context;
    Response response;
    return (jobs_.get()->*method)(&context, request, &response);
  }

  grpc::Status Watch(const std::string& job_id) {
    grpc::ClientContext context;
    v1::WatchJobRequest request;
    request.set_job_id(job_id);
    const auto stream = jobs_->WatchJob(&context, request);
    v1::WatchJobResponse response;
    while (stream->Read(&response)) last_event_ = response.event();
    return stream->Finish();
  }

  grpc::Status Stream(const std::string& job_id, uint64_t offset = 0, bool chunk = false) {
    grpc::ClientContext context;
    v1::StreamSurfaceRequest request;
    request.set_job_id(job_id);
    chunk ? request.set_chunk(99) : request.set_offset(offset);
    const auto stream = jobs_->StreamSurface(&context, request);
    v1::StreamSurfaceResponse response;
    while (stream->Read(&response)) {
    }
    return stream->Finish();
  }

  TestFolder test_;
  int stores_ = 0;
  std::string store_, job_id_;
  std::unique_ptr<v1::JobsService::Stub> jobs_;
  v1::JobEvent last_event_;
  std::set<std::string> seen_;
};

}  // namespace rilievo
