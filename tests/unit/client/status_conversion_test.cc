#include "client/library/status_conversion.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "grpcpp/support/status.h"

namespace rilievo {
namespace {

TEST(StatusFromGrpc, PlainErrorsKeepCodeAndMessage) {
  EXPECT_TRUE(StatusFromGrpc(grpc::Status::OK).ok());
  const absl::Status status =
      StatusFromGrpc(grpc::Status(grpc::StatusCode::UNAVAILABLE, "no route"));
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(status.message(), "no route");
  EXPECT_EQ(RetryDelay(status), std::nullopt);
  EXPECT_EQ(ErrorReason(status), "");
}

TEST(StatusFromGrpc, AddsViolationsThatTheMessageDoesNotHold) {
  google::rpc::BadRequest bad;
  auto* first = bad.add_field_violations();
  first->set_field("header.point_count");
  first->set_description("3 points");
  auto* second = bad.add_field_violations();
  second->set_field("header.options.max_level");
  second->set_description("9 is outside [0, 8]");
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(1);
  retry.mutable_retry_delay()->set_nanos(250'000'000);
  google::rpc::ErrorInfo info;
  info.set_reason("LIMIT_EXCEEDED");
  info.set_domain("rilievo.dev");
  google::rpc::Status details;
  details.add_details()->PackFrom(bad);
  details.add_details()->PackFrom(retry);
  details.add_details()->PackFrom(info);
  const absl::Status status =
      StatusFromGrpc(grpc::Status(grpc::StatusCode::INVALID_ARGUMENT,
                                  "header.point_count: 3 points", details.SerializeAsString()));
  EXPECT_EQ(status.message(),
            "header.point_count: 3 points; header.options.max_level: 9 is outside [0, 8]");
  EXPECT_EQ(RetryDelay(status), std::chrono::milliseconds(1250));
  EXPECT_EQ(ErrorReason(status), "LIMIT_EXCEEDED");
}

TEST(StatusFromGrpc, TakesReasonsOfTheServerAlone) {
  for (const auto& [domain, reason] : std::map<std::string, std::string>{
           {"rilievo.dev", "JOBS_LIMIT"}, {"rilievo", "JOBS_LIMIT"}, {"proxy.example", ""}}) {
    google::rpc::ErrorInfo info;
    info.set_reason("JOBS_LIMIT");
    info.set_domain(domain);
    google::rpc::Status details;
    details.add_details()->PackFrom(info);
    EXPECT_EQ(ErrorReason(StatusFromGrpc(grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED, "full",
                                                      details.SerializeAsString()))),
              reason)
        << domain;
  }
}

TEST(StatusFromRpc, KeepsTheFieldsAtFault) {
  EXPECT_TRUE(StatusFromRpc(google::rpc::Status()).ok());
  google::rpc::BadRequest bad;
  auto* violation = bad.add_field_violations();
  violation->set_field("points");
  violation->set_description("all are one");
  google::rpc::Status failed;
  failed.set_code(static_cast<int>(absl::StatusCode::kInvalidArgument));
  failed.set_message("points: all are one");
  EXPECT_TRUE(ViolatedFields(StatusFromRpc(failed)).empty());
  failed.add_details()->PackFrom(bad);
  const absl::Status status = StatusFromRpc(failed);
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "points: all are one");
  const std::vector<ViolatedField> fields = ViolatedFields(status);
  ASSERT_EQ(fields.size(), 1u);
  EXPECT_EQ(fields[0].field, "points");
  EXPECT_EQ(fields[0].description, "all are one");
}

TEST(StatusFromGrpc, SurvivesDetailsThatAreNoStatus) {
  const absl::Status status =
      StatusFromGrpc(grpc::Status(grpc::StatusCode::INTERNAL, "broken", "\xff\xff\x01garbage"));
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_EQ(status.message(), "broken");
  EXPECT_EQ(ErrorReason(status), "");
}

}  // namespace
}  // namespace rilievo
