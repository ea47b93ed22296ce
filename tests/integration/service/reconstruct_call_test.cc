// The protocol of Reconstruct, message by message, on a real socket.
#include "server/reconstruct_call.h"

#include "tests/integration/service/service_fixture.h"

namespace rilievo {
namespace {

using grpc::StatusCode;
using std::chrono::milliseconds;
using std::chrono::steady_clock;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class ReconstructCallTest : public ServiceTest {
 protected:
  // One call whose requests are written as given, then half-closed.
  Outcome Call(const std::vector<v1::ReconstructRequest>& requests) {
    grpc::ClientContext context;
    const auto stream = NewStub()->Reconstruct(&context);
    for (const auto& request : requests) {
      if (!stream->Write(request)) break;
    }
    stream->WritesDone();
    return ReadToEnd(stream.get());
  }
};

TEST_F(ReconstructCallTest, AnswersWithProgressSurfaceAndSummary) {
  StartServer();
  const Outcome outcome =
      Call({HeaderRequest(50), PointsRequest(20), PointsRequest(1), PointsRequest(29)});
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(work_.last_point_count(), 50);

  enum { kProgress, kSurface, kPieces, kSummary } phase = kProgress;
  int last_stage = 0;
  std::vector<std::vector<uint8_t>> chunks(work_.chunk_sizes.size());
  uint64_t offset = 0;
  for (const auto& response : outcome.responses) {
    if (response.has_progress()) {
      EXPECT_EQ(phase, kProgress);
      EXPECT_GE(response.progress().stage(), last_stage);
      last_stage = response.progress().stage();
    } else if (response.has_surface()) {
      EXPECT_EQ(phase, kProgress);
      phase = kSurface;
      EXPECT_EQ(response.surface().total_bytes(), 301'077u);
      EXPECT_EQ(response.surface().chunk_bytes_size(), 4);
    } else if (response.has_piece()) {
      EXPECT_TRUE(phase == kSurface || phase == kPieces);
      phase = kPieces;
      EXPECT_EQ(response.piece().offset(), offset);
      EXPECT_LE(response.piece().data().size(), 256u << 10);
      offset += response.piece().data().size();
      auto& chunk = chunks.at(response.piece().chunk());
      chunk.insert(chunk.end(), response.piece().data().begin(), response.piece().data().end());
    } else if (response.has_summary()) {
      EXPECT_EQ(phase, kPieces);
      phase = kSummary;
      EXPECT_EQ(response.summary().report().points_in(), 50);
    }
  }
  EXPECT_EQ(phase, kSummary);
  EXPECT_EQ(last_stage, v1::STAGE_ENCODE);
  EXPECT_EQ(chunks, work_.Encoded().chunks);
}

TEST_F(ReconstructCallTest, PointsThatDoNotFitIntoMemoryGoToDiskAndThenToParts) {
  ServerOptions options;
  options.scratch = testing::TempDir();
  options.part_points = 2048;
  options.memory_budget = 90'000'000;
  StartServer(options);
  v1::ReconstructRequest header = HeaderRequest(13'000);
  header.mutable_header()->mutable_options()->mutable_fit()->set_sample_level(4);
  const Outcome part = Call({header, PointsRequest(8'000)});
  EXPECT_EQ(Reason(part.status), "SCAN_INCOMPLETE");
  const Outcome more = Call({header, PointsRequest(8'000), PointsRequest(5'001)});
  EXPECT_THAT(more.status.error_message(), HasSubstr("more points came"));
  // All at one place: that is what parts find.
  const Outcome whole = Call({header, PointsRequest(8'000), PointsRequest(5'000)});
  EXPECT_EQ(Reason(whole.status), "UNUSABLE_SCAN");
  EXPECT_THAT(whole.status.error_message(), HasSubstr("1 distinct finite points"));
  EXPECT_EQ(work_.begun(), 0);
  ASSERT_TRUE(WaitForLogged(3, std::chrono::seconds(5)));
  EXPECT_EQ(log_.back().bytes_in, 13'000 * 12);
}

TEST_F(ReconstructCallTest, RefusesAnImpossibleScanFromItsHeaderAlone) {
  StartServer();
  for (const uint64_t claimed : {uint64_t{4'000'000'000}, ~uint64_t{0}}) {
    const auto start = steady_clock::now();
    grpc::ClientContext context;
    const auto stream = NewStub()->Reconstruct(&context);
    ASSERT_TRUE(stream->Write(HeaderRequest(claimed)));
    // Neither points nor a half-close follow: the header must be enough.
    const Outcome outcome = ReadToEnd(stream.get());
    EXPECT_LT(SecondsSince(start), 1);
    EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("header.point_count"));
    EXPECT_EQ(Reason(outcome.status), "LIMIT_EXCEEDED");
  }
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructCallTest, ListsAllFaultsOfTheHeader) {
  StartServer();
  v1::ReconstructRequest request = HeaderRequest(3);
  request.mutable_header()->set_coordinate_format(static_cast<v1::CoordinateFormat>(9));
  request.mutable_header()->mutable_options()->mutable_fit()->set_rounds(0);
  const Outcome outcome = Call({request});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(
      ViolatedFields(outcome.status),
      ElementsAre("header.coordinate_format", "header.point_count", "header.options.fit.rounds"));
}

TEST_F(ReconstructCallTest, RefusesMessagesOutOfOrder) {
  StartServer();
  const std::vector<std::pair<std::vector<v1::ReconstructRequest>, std::string>> cases = {
      {{}, "header"},
      {{v1::ReconstructRequest()}, "header"},
      {{PointsRequest(20), HeaderRequest(20)}, "header"},
      {{HeaderRequest(20), HeaderRequest(20)}, "points"},
      {{HeaderRequest(20), v1::ReconstructRequest()}, "points"},
  };
  for (const auto& [requests, field] : cases) {
    const Outcome outcome = Call(requests);
    EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
    EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre(field));
  }
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructCallTest, MorePointsThanAnnouncedAreRefused) {
  StartServer();
  const Outcome outcome = Call({HeaderRequest(20), PointsRequest(20), PointsRequest(1)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("points.data"));
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructCallTest, FewerPointsThanAnnouncedAreDataLoss) {
  StartServer();
  const Outcome outcome = Call({HeaderRequest(30), PointsRequest(29)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::DATA_LOSS);
  EXPECT_THAT(outcome.status.error_message(), HasSubstr("29 of 30"));
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructCallTest, WorkBeginsAtTheHalfCloseAndNotBefore) {
  StartServer();
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  ASSERT_TRUE(stream->Write(HeaderRequest(20)));
  ASSERT_TRUE(stream->Write(PointsRequest(20)));
  EXPECT_FALSE(work_.WaitForBegun(1, milliseconds(300)));
  stream->WritesDone();
  EXPECT_TRUE(work_.WaitForBegun(1));
  EXPECT_TRUE(ReadToEnd(stream.get()).status.ok());
}

TEST_F(ReconstructCallTest, BrokenAndOversizedChunksAreRefused) {
  StartServer();
  v1::ReconstructRequest broken = PointsRequest(2);
  broken.mutable_points()->mutable_data()->pop_back();
  Outcome outcome = Call({HeaderRequest(20), broken});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("points.data"));

  // Over the limit on a chunk, then over the limit on a message, which gRPC itself refuses.
  outcome = Call({HeaderRequest(1'000'000), PointsRequest(100'000)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("points.data"));
  outcome = Call({HeaderRequest(1'000'000), PointsRequest(500'000)});
  EXPECT_FALSE(outcome.status.ok());
  EXPECT_EQ(work_.begun(), 0);
}

TEST_F(ReconstructCallTest, ErrorsOfTheWorkNameTheField) {
  work_.answer = absl::InvalidArgumentError("the 50 points are collinear; a surface needs area");
  StartServer();
  const Outcome outcome = Call({HeaderRequest(50), PointsRequest(50)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(ViolatedFields(outcome.status), ElementsAre("points"));
  EXPECT_THAT(outcome.status.error_message(), HasSubstr("collinear"));
}

TEST_F(ReconstructCallTest, DefectsTellTheOperatorNotTheClient) {
  work_.answer = absl::InternalError("/srv/rilievo/core/loop.cc:12 on host alpha");
  StartServer();
  const Outcome outcome = Call({HeaderRequest(50), PointsRequest(50)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INTERNAL);
  EXPECT_THAT(outcome.status.error_message(), Not(HasSubstr("/srv")));
  EXPECT_THAT(outcome.status.error_message(), Not(HasSubstr("job 1")))
      << "which would tell how much the server does for others";
  EXPECT_THAT(outcome.status.error_details(), Not(HasSubstr("/srv")));
  ASSERT_TRUE(server_->WaitUntilIdle(milliseconds(5000)));
  const std::lock_guard lock(log_mutex_);
  ASSERT_EQ(log_.size(), 1u);
  EXPECT_THAT(log_[0].detail, HasSubstr("/srv/rilievo"));
}

TEST_F(ReconstructCallTest, AnExceptionEndsItsOwnCallOnly) {
  std::atomic<int> calls{0};
  work_.before_wait = [&](const RunContext&) {
    if (calls++ == 0) throw std::logic_error("/srv/secret");
    if (calls == 2) throw std::bad_alloc();
  };
  StartServer();
  Outcome outcome = Call({HeaderRequest(50), PointsRequest(50)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::INTERNAL);
  EXPECT_THAT(outcome.status.error_message(), Not(HasSubstr("secret")));
  outcome = Call({HeaderRequest(50), PointsRequest(50)});
  EXPECT_EQ(outcome.status.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(Call({HeaderRequest(50), PointsRequest(50)}).status.ok());
}

TEST_F(ReconstructCallTest, ASlowReaderGetsTheLatestProgressAndEverythingElse) {
  work_.before_wait = [](const RunContext& context) {
    for (int round = 0; round < 20000; ++round) {
      for (int stage = 0; stage < kStageCount; ++stage) {
        context.Report(static_cast<Stage>(stage), 1);
      }
    }
  };
  StartServer();
  grpc::ClientContext context;
  const auto stream = NewStub()->Reconstruct(&context);
  SendWholeScan(stream.get(), 50);
  std::this_thread::sleep_for(milliseconds(500));
  const Outcome outcome = ReadToEnd(stream.get());
  EXPECT_TRUE(outcome.status.ok());
  EXPECT_TRUE(outcome.responses.back().has_summary());
}

TEST_F(ReconstructCallTest, LogsOneRecordACall) {
  StartServer();
  ASSERT_TRUE(Call({HeaderRequest(50), PointsRequest(50)}).status.ok());
  ASSERT_TRUE(server_->WaitUntilIdle(milliseconds(5000)));  // its record follows its answer
  ASSERT_FALSE(Call({HeaderRequest(30), PointsRequest(29)}).status.ok());
  ASSERT_TRUE(server_->WaitUntilIdle(milliseconds(5000)));
  const std::lock_guard lock(log_mutex_);
  ASSERT_EQ(log_.size(), 2u);
  EXPECT_EQ(log_[0].code, absl::StatusCode::kOk);
  EXPECT_EQ(log_[0].points_announced, 50);
  EXPECT_EQ(log_[0].bytes_in, 600);
  EXPECT_EQ(log_[0].bytes_out, 301'077);
  EXPECT_EQ(log_[0].road, "spherical");
  EXPECT_EQ(log_[1].code, absl::StatusCode::kDataLoss);
  EXPECT_EQ(log_[1].bytes_in, 29 * 12);
}

}  // namespace
}  // namespace rilievo
