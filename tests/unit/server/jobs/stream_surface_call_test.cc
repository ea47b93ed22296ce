#include "server/jobs/stream_surface_call.h"

#include "tests/unit/server/jobs/far_blobs.h"
#include "tests/unit/server/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

class StreamSurfaceCallTest : public JobsServiceTest {
 protected:
  grpc::Status Stream(const v1::StreamSurfaceRequest& request, std::string* bytes,
                      v1::SurfaceHeader* header = nullptr) {
    grpc::ClientContext context;
    const auto stream = stub_->StreamSurface(&context, request);
    v1::StreamSurfaceResponse response;
    while (stream->Read(&response)) {
      if (response.has_surface() && header != nullptr) *header = response.surface();
      *bytes += response.piece().data();
    }
    return stream->Finish();
  }

  v1::StreamSurfaceRequest Finished() {
    v1::StreamSurfaceRequest request;
    request.set_job_id(Submit("r").job_id());
    std::vector<v1::JobEvent> events;
    EXPECT_TRUE(Watch(request.job_id(), 0, &events).ok());
    return request;
  }
};

TEST_F(StreamSurfaceCallTest, TheWholeOrTheRest) {
  Open();
  v1::StreamSurfaceRequest request = Finished();
  std::string whole, rest, nothing;
  v1::SurfaceHeader header;
  EXPECT_TRUE(Stream(request, &whole, &header).ok());
  EXPECT_EQ(whole, "surface");
  EXPECT_EQ(header.total_bytes(), 7u);
  request.set_offset(3);
  EXPECT_TRUE(Stream(request, &rest).ok());
  EXPECT_EQ(rest, "face");
  request.set_offset(7);
  EXPECT_TRUE(Stream(request, &nothing).ok());
  EXPECT_EQ(nothing, "");
}

TEST_F(StreamSurfaceCallTest, WhatIsNotThereIsTold) {
  Open();
  v1::StreamSurfaceRequest request = Finished();
  std::string bytes;
  request.set_offset(8);
  EXPECT_EQ(Stream(request, &bytes).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  request.set_chunk(1);
  EXPECT_EQ(Stream(request, &bytes).error_code(), grpc::StatusCode::OUT_OF_RANGE);
  request.set_job_id("none");
  EXPECT_EQ(Stream(request, &bytes).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(bytes, "");
}

TEST_F(StreamSurfaceCallTest, AJobThatIsNotDoneHasNone) {
  work_.wait = true;
  Open();
  v1::StreamSurfaceRequest request;
  request.set_job_id(Submit("r").job_id());
  ASSERT_TRUE(work_.WaitForBegun(1));
  std::string bytes;
  const grpc::Status status = Stream(request, &bytes);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOf(status), "JOB_NOT_SUCCEEDED");
}

TEST_F(StreamSurfaceCallTest, BlobsThatCannotBeReachedAreNoDamage) {
  Distance distance;
  open_store_ = [&](const ServerOptions& options, StoreSettings settings) {
    return OpenFarStore(options, std::move(settings), &distance);
  };
  Open();
  const v1::StreamSurfaceRequest request = Finished();
  std::string bytes;
  distance.away = true;
  const grpc::Status away = Stream(request, &bytes);
  EXPECT_EQ(away.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(ReasonOf(away), "STORE_BUSY");
  distance.away = false;
  EXPECT_TRUE(Stream(request, &bytes).ok());
  EXPECT_EQ(bytes, "surface");
  EXPECT_EQ(distance.heard, 1) << "the thread says that it gets on";
  Close();
}

TEST_F(StreamSurfaceCallTest, BytesThatWereSentAreCounted) {
  Open();
  std::string bytes;
  EXPECT_TRUE(Stream(Finished(), &bytes).ok());
  EXPECT_THAT(core_->metrics->Text(), testing::HasSubstr("rilievo_sent_bytes_total 7\n"));
}

}  // namespace
}  // namespace rilievo
