// What the client does where a server breaks off: it goes on, and does nothing twice.
#include "client/library/jobs_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>

#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"

namespace rilievo {
namespace {

using grpc::ServerContext;
using grpc::Status;
using grpc::StatusCode;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Breaks off after a few messages, and counts what it is asked.
class BrittleJobs final : public v1::JobsService::Service {
 public:
  Status StreamSurface(ServerContext*, const v1::StreamSurfaceRequest* request,
                       grpc::ServerWriter<v1::StreamSurfaceResponse>* writer) override {
    asked_offsets.push_back(request->offset());
    v1::StreamSurfaceResponse response;
    response.mutable_surface()->set_total_bytes(surface.size());
    writer->Write(response);
    for (size_t at = request->offset(); at < surface.size(); at += 1000) {
      if (at - request->offset() == 3000 && asked_offsets.size() < 3) return away;
      response.mutable_piece()->set_offset(at + gap);
      response.mutable_piece()->set_data(surface.substr(at, 1000));
      writer->Write(response);
    }
    return Status::OK;
  }

  Status GetUpload(ServerContext*, const v1::GetUploadRequest*,
                   v1::GetUploadResponse* response) override {
    response->set_stored_bytes(uploaded.size());
    return Status::OK;
  }

  Status UploadScan(ServerContext*, grpc::ServerReader<v1::UploadScanRequest>* reader,
                    v1::UploadScanResponse*) override {
    v1::UploadScanRequest request;
    reader->Read(&request);
    asked_offsets.push_back(request.header().offset());
    for (int chunks = 0; reader->Read(&request); ++chunks) {
      if (request.has_end()) return Status::OK;
      if (chunks == 2 && asked_offsets.size() < 3) return away;
      uploaded += request.chunk();
    }
    return {StatusCode::DATA_LOSS, "closed before `end`"};
  }

  Status WatchJob(ServerContext*, const v1::WatchJobRequest* request,
                  grpc::ServerWriter<v1::WatchJobResponse>* writer) override {
    asked_offsets.push_back(request->after_sequence());
    v1::WatchJobResponse response;
    for (uint64_t event = request->after_sequence() + 1; event <= 7; ++event) {
      if (event == request->after_sequence() + 4) return away;
      response.mutable_event()->set_sequence(event);
      writer->Write(response);
    }
    return Status::OK;
  }

  Status GetJob(ServerContext*, const v1::GetJobRequest* request,
                v1::GetJobResponse* response) override {
    response->mutable_job()->set_job_id(request->job_id());
    return Status::OK;
  }

  Status CreateJob(ServerContext*, const v1::CreateJobRequest* request,
                   v1::CreateJobResponse* response) override {
    const std::lock_guard lock(mutex);
    requests.push_back(request->request_id());
    if (requests.size() <= failures) return away;
    response->mutable_job()->set_job_id("one");
    return Status::OK;
  }

  std::string surface, uploaded;
  uint64_t gap = 0;
  Status away{StatusCode::UNAVAILABLE, "away"};
  std::vector<uint64_t> asked_offsets;
  std::mutex mutex;
  size_t failures = 3;
  std::vector<std::string> requests;
};

class JobsClientTest : public testing::Test {
 protected:
  JobsClientTest() {
    grpc::ServerBuilder builder;
    builder.RegisterService(&jobs_);
    server_ = builder.BuildAndStart();
    for (int i = 0; i < 10'500; ++i) jobs_.surface += static_cast<char>(i * 7);
  }

  JobsClient Client(int attempts = 8) const {
    return JobsClient(
        server_->InProcessChannel({}),
        {.attempts = attempts, .first_pause = milliseconds(5), .longest_pause = milliseconds(20)});
  }

  BrittleJobs jobs_;
  std::unique_ptr<grpc::Server> server_;
};

TEST_F(JobsClientTest, ADownloadGoesOnAtTheByteWhereItBroke) {
  const auto bytes = Client().Fetch("job");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(std::string(bytes->begin(), bytes->end()), jobs_.surface);
  EXPECT_EQ(jobs_.asked_offsets, (std::vector<uint64_t>{0, 3000, 6000}));
}

TEST_F(JobsClientTest, WhatBreaksAtOneServerGoesOnAtTheNext) {
  BrittleJobs second;
  second.surface = jobs_.surface;
  grpc::ServerBuilder builder;
  builder.RegisterService(&second);
  const auto other = builder.BuildAndStart();
  const JobsClient client({server_->InProcessChannel({}), other->InProcessChannel({})},
                          {.attempts = 2, .first_pause = milliseconds(5)});
  const auto bytes = client.Fetch("job");
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_EQ(std::string(bytes->begin(), bytes->end()), jobs_.surface);
  EXPECT_EQ(jobs_.asked_offsets, (std::vector<uint64_t>{0, 6000}));
  EXPECT_EQ(second.asked_offsets, (std::vector<uint64_t>{3000, 9000}));
  second.failures = jobs_.failures = 1;
  ASSERT_TRUE(client.Create({}).ok()) << "each may fail once";
  EXPECT_EQ(second.requests.size(), 2u) << "where the last call went";
  EXPECT_EQ(jobs_.requests.size(), 1u);
}

TEST_F(JobsClientTest, ADownloadWithAGapIsNoSurface) {
  jobs_.gap = 1;
  EXPECT_TRUE(absl::IsDataLoss(Client().Fetch("job").status()));
  EXPECT_EQ(jobs_.asked_offsets.size(), 1u) << "not asked again";
}

TEST_F(JobsClientTest, AnUploadGoesOnWhereTheServerHasIt) {
  PackedScan scan;
  scan.bytes.assign(2'000'000, 'x');
  scan.scan_id = std::string(64, '0');
  ASSERT_TRUE(Client().Upload(scan).ok());
  EXPECT_EQ(jobs_.uploaded, scan.bytes) << "every byte once";
  ASSERT_EQ(jobs_.asked_offsets.size(), 3u);
  EXPECT_GT(jobs_.asked_offsets[1], 0u);
  EXPECT_GT(jobs_.asked_offsets[2], jobs_.asked_offsets[1]);
}

TEST_F(JobsClientTest, AWatchGoesOnBehindTheLastEvent) {
  std::vector<uint64_t> seen;
  const auto job =
      Client().Watch("job", [&](const v1::JobEvent& event) { seen.push_back(event.sequence()); });
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(seen, (std::vector<uint64_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(jobs_.asked_offsets, (std::vector<uint64_t>{0, 3, 6}));
}

TEST_F(JobsClientTest, ARepeatedCreateIsTheSameRequest) {
  v1::CreateJobRequest request;
  request.set_request_id("mine");
  ASSERT_TRUE(Client().Create(request).ok());
  EXPECT_EQ(jobs_.requests, (std::vector<std::string>(4, "mine")));
  jobs_.requests.clear();
  EXPECT_TRUE(absl::IsUnavailable(Client(3).Create(request).status()));
  EXPECT_EQ(jobs_.requests.size(), 3u);
}

TEST_F(JobsClientTest, ErrorsThatAreNotAboutTheMomentAreFinal) {
  jobs_.away = Status(StatusCode::INVALID_ARGUMENT, "wrong");
  EXPECT_TRUE(absl::IsInvalidArgument(Client().Create({}).status()));
  EXPECT_EQ(jobs_.requests.size(), 1u);
}

TEST_F(JobsClientTest, TheTimeoutIsOfAllAttemptsTogether) {
  const auto start = steady_clock::now();
  CallOptions call;
  call.timeout = milliseconds(100);
  jobs_.failures = 1'000'000;
  EXPECT_FALSE(Client(1'000'000).Create({}, call).ok());
  EXPECT_LT(steady_clock::now() - start, milliseconds(1000));
  EXPECT_GT(jobs_.requests.size(), 2u);
}

}  // namespace
}  // namespace rilievo
