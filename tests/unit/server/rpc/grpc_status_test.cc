#include "server/rpc/grpc_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace rilievo {
namespace {

template <typename Detail>
std::optional<Detail> FindDetail(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), status.error_code());
  EXPECT_EQ(details.message(), status.error_message());
  for (const auto& any : details.details()) {
    Detail detail;
    if (any.UnpackTo(&detail)) return detail;
  }
  return std::nullopt;
}

TEST(GrpcStatus, CarriesViolationsReasonAndRetry) {
  CallError error = BadRequestError({{"header.point_count", "3 points; at least 20"},
                                     {"header.options.fit.rounds", "0 is outside [1, 50]"}},
                                    ErrorCause::kLimitExceeded);
  error.Limit(20, 3).RetryAfter(std::chrono::milliseconds(2500));
  const grpc::Status status = GrpcStatus(error);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(status.error_message(),
            "header.point_count: 3 points; at least 20; header.options.fit.rounds: 0 is outside "
            "[1, 50]");
  const auto bad = FindDetail<google::rpc::BadRequest>(status);
  ASSERT_TRUE(bad.has_value());
  ASSERT_EQ(bad->field_violations_size(), 2);
  EXPECT_EQ(bad->field_violations(1).field(), "header.options.fit.rounds");
  EXPECT_EQ(bad->field_violations(1).description(), "0 is outside [1, 50]");
  const auto retry = FindDetail<google::rpc::RetryInfo>(status);
  ASSERT_TRUE(retry.has_value());
  EXPECT_EQ(retry->retry_delay().seconds(), 2);
  EXPECT_EQ(retry->retry_delay().nanos(), 500'000'000);
  const auto info = FindDetail<google::rpc::ErrorInfo>(status);
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->reason(), "LIMIT_EXCEEDED");
  EXPECT_EQ(info->domain(), "rilievo.dev");
  EXPECT_EQ(info->metadata().at("limit"), "20");
  EXPECT_EQ(info->metadata().at("value"), "3");
}

TEST(GrpcStatus, FitsATrailerWhateverItHolds) {
  std::vector<FieldViolation> many(1000, {std::string(3000, 'f'), std::string(3000, 'd')});
  const grpc::Status status = GrpcStatus(BadRequestError(many));
  // Binary trailers grow by a third in base64; the message is there twice.
  EXPECT_LT(status.error_details().size() * 4 / 3 + status.error_message().size(), 14000u);
}

TEST(GrpcStatus, CutsTextBetweenCharacters) {
  CallError error(ErrorCause::kServerDefect, "");
  for (int i = 0; i < 400; ++i) error.message += "\u00e9";  // two bytes each
  for (const int shift : {0, 1}) {
    error.message.insert(0, static_cast<size_t>(shift), 'x');
    google::rpc::Status details;
    EXPECT_TRUE(details.ParseFromString(GrpcStatus(error).error_details()));
    const std::string text = details.message().substr(0, details.message().size() - 3);
    EXPECT_EQ((text.size() - static_cast<size_t>(shift)) % 2, 0u);
  }
}

TEST(GrpcStatus, ExplainsWhatGrpcLeavesUnsaid) {
  const grpc::Status mute(grpc::StatusCode::UNIMPLEMENTED, "");
  const auto explained = [&](const char* method) {
    return FindDetail<google::rpc::ErrorInfo>(ExplainedStatus(method, mute))->reason();
  };
  EXPECT_EQ(explained("/rilievo.v1.JobsService/GetJob"), "MALFORMED_MESSAGE");
  EXPECT_EQ(explained("/rilievo.v1.JobsService/GetJobs"), "UNKNOWN_METHOD");
  EXPECT_EQ(explained("/"), "UNKNOWN_METHOD");
  EXPECT_EQ(explained(""), "UNKNOWN_METHOD");
  const grpc::Status worded(grpc::StatusCode::UNIMPLEMENTED, "compressed");
  EXPECT_EQ(ExplainedStatus("/x/Y", worded).error_details(), "");
  EXPECT_TRUE(ExplainedStatus("/x/Y", grpc::Status::OK).ok());
}

}  // namespace
}  // namespace rilievo
