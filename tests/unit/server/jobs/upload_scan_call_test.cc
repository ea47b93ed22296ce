#include "server/jobs/upload_scan_call.h"

#include "server/store/content_name.h"
#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using Code = grpc::StatusCode;

class UploadScanCallTest : public JobsServiceTest {
 protected:
  // How a stream of these messages ends.
  grpc::Status Send(const std::vector<v1::UploadScanRequest>& messages) {
    grpc::ClientContext context;
    v1::UploadScanResponse response;
    const auto stream = stub_->UploadScan(&context, &response);
    for (const auto& message : messages) {
      if (!stream->Write(message)) break;
    }
    stream->WritesDone();
    return stream->Finish();
  }

  static v1::UploadScanRequest Header(uint64_t total, uint64_t offset = 0) {
    v1::UploadScanRequest request;
    request.mutable_header()->set_upload_id("u");
    request.mutable_header()->set_total_bytes(total);
    request.mutable_header()->set_offset(offset);
    return request;
  }
  static v1::UploadScanRequest Chunk(const std::string& bytes) {
    v1::UploadScanRequest request;
    request.set_chunk(bytes);
    return request;
  }
  static v1::UploadScanRequest End(uint64_t total, const std::string& sha256) {
    v1::UploadScanRequest request;
    request.mutable_end()->set_total_bytes(total);
    request.mutable_end()->set_sha256(sha256);
    return request;
  }

  uint64_t StoredBytes() {
    v1::GetUploadRequest request;
    request.set_upload_id("u");
    v1::GetUploadResponse response;
    grpc::ClientContext context;
    EXPECT_TRUE(stub_->GetUpload(&context, request, &response).ok());
    return response.stored_bytes();
  }
};

TEST_F(UploadScanCallTest, AWholeOneIsAScan) {
  Open();
  v1::UploadScanResponse response;
  EXPECT_TRUE(Upload("u", "some bytes", &response).ok());
  EXPECT_EQ(response.scan_id(), ContentNameOf("some bytes"));
  EXPECT_EQ(response.total_bytes(), 10u);
  EXPECT_EQ(StoredBytes(), 0u) << "it is an upload no more";
}

TEST_F(UploadScanCallTest, ACutOneGoesOn) {
  Open();
  EXPECT_EQ(Send({Header(10), Chunk("some ")}).error_code(), Code::DATA_LOSS);
  EXPECT_EQ(StoredBytes(), 5u);
  EXPECT_EQ(Send({Header(10, 6), Chunk("ytes")}).error_code(), Code::OUT_OF_RANGE);
  EXPECT_EQ(Send({Header(10, 5), Chunk("bytes"), End(10, std::string(32, 'x'))}).error_code(),
            Code::DATA_LOSS)
      << "another digest";
  EXPECT_EQ(StoredBytes(), 0u) << "what is wrong is dropped";
}

TEST_F(UploadScanCallTest, MessagesComeInOrder) {
  Open();
  for (const auto& messages :
       std::vector<std::vector<v1::UploadScanRequest>>{{Chunk("x")},
                                                       {Header(0)},
                                                       {Header(10), Header(10)},
                                                       {Header(10), Chunk("")},
                                                       {Header(10), Chunk("more than ten bytes")},
                                                       {Header(10), End(10, "short")}}) {
    EXPECT_EQ(Send(messages).error_code(), Code::INVALID_ARGUMENT);
  }
}

TEST_F(UploadScanCallTest, ASilentOneAndASlowOneAreSentAway) {
  ServerOptions options;
  options.max_idle_time = std::chrono::milliseconds(300);
  Open(options);
  grpc::ClientContext idle_context;
  v1::UploadScanResponse response;
  const auto idle = stub_->UploadScan(&idle_context, &response);
  idle->Write(Header(10));
  EXPECT_EQ(ReasonOf(idle->Finish()), "IDLE_LIMIT");

  options.max_idle_time = std::chrono::seconds(60);
  options.max_job_time = std::chrono::milliseconds(300);
  Open(options);
  grpc::ClientContext slow_context;
  const auto slow = stub_->UploadScan(&slow_context, &response);
  slow->Write(Header(10));
  slow->Write(Chunk("x"));
  EXPECT_EQ(ReasonOf(slow->Finish()), "UPLOAD_TIME_LIMIT");
  EXPECT_EQ(StoredBytes(), 1u) << "what came is kept";
}

TEST_F(UploadScanCallTest, ASlowButSteadyOneGoesOn) {
  ServerOptions options;
  options.max_job_time = std::chrono::milliseconds(300);
  Open(options);
  const std::string bytes(20'000, 'x');  // at 20 000 bytes/s
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  const auto stream = stub_->UploadScan(&context, &response);
  stream->Write(Header(bytes.size()));
  for (size_t begin = 0; begin < bytes.size(); begin += 1000) {
    stream->Write(Chunk(bytes.substr(begin, 1000)));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  stream->Write(End(bytes.size(), absl::HexStringToBytes(ContentNameOf(bytes))));
  stream->WritesDone();
  const grpc::Status status = stream->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(UploadScanCallTest, WhatIsStoredIsNotRefused) {
  for (const bool idle : {false, true}) {
    ServerOptions options;
    (idle ? options.max_idle_time : options.max_job_time) = std::chrono::milliseconds(300);
    Open(options);
    grpc::ClientContext context;
    v1::UploadScanResponse response;
    const auto stream = stub_->UploadScan(&context, &response);
    stream->Write(Header(5));
    stream->Write(Chunk("bytes"));
    stream->Write(End(5, absl::HexStringToBytes(ContentNameOf("bytes"))));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    stream->WritesDone();
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(response.scan_id(), ContentNameOf("bytes"));
  }
}

TEST_F(UploadScanCallTest, PlacesAreSharedAndGivenBack) {
  ServerOptions options;
  options.max_uploads = 2;
  Open(options);
  grpc::ClientContext context;
  v1::UploadScanResponse response;
  auto first = stub_->UploadScan(&context, &response);
  first->Write(Header(10));
  while (StoredBytes() == 0) first->Write(Chunk("x"));  // it is under way
  EXPECT_EQ(ReasonOf(Send({Header(10)})), "JOBS_LIMIT");
  context.TryCancel();
  first->Finish();
  grpc::Status next;
  for (int i = 0; i < 200 && ReasonOf(next = Upload("v", "bytes", &response)) == "JOBS_LIMIT";
       ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(next.ok()) << next.error_message();
}

TEST_F(UploadScanCallTest, NoneBeginWhileTheServerEnds) {
  Open();
  core_->draining = true;
  EXPECT_EQ(ReasonOf(Send({Header(10)})), "SHUTTING_DOWN");
}

}  // namespace
}  // namespace rilievo
