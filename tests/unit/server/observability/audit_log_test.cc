#include "server/observability/audit_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

using absl::StatusCode;
using testing::ElementsAre;
using testing::Pair;

TEST(AuditLog, TellsOfChangesAndOfRefusals) {
  for (const char* call : {"CreateJob", "CancelJob", "DeleteJob", "DeleteScan", "UploadScan"}) {
    for (const auto outcome : {StatusCode::kOk, StatusCode::kInvalidArgument, StatusCode::kNotFound,
                               StatusCode::kUnauthenticated}) {
      EXPECT_TRUE(IsAudited(call, outcome)) << call << " " << outcome;
    }
  }
  for (const char* call : {"GetJob", "ListJobs", "WatchJob", "Reconstruct", "GetUpload"}) {
    for (const auto outcome : {StatusCode::kUnauthenticated, StatusCode::kPermissionDenied,
                               StatusCode::kResourceExhausted}) {
      EXPECT_TRUE(IsAudited(call, outcome)) << call << " " << outcome;
    }
    for (const auto outcome :
         {StatusCode::kOk, StatusCode::kInvalidArgument, StatusCode::kNotFound}) {
      EXPECT_FALSE(IsAudited(call, outcome)) << call << " " << outcome;
    }
  }
}

TEST(AuditLog, ALineHoldsWhatIsKnown) {
  const AuditRecord refused = {.call = "GetJob",
                               .peer = "ipv4:10.0.0.1:4711",
                               .outcome = StatusCode::kUnauthenticated,
                               .reason = "NO_TOKEN"};
  EXPECT_THAT(AuditFields(refused, 0),
              ElementsAre(Pair("call", "GetJob"), Pair("outcome", "UNAUTHENTICATED"),
                          Pair("reason", "NO_TOKEN"), Pair("peer", "ipv4:10.0.0.1:4711")));
  const AuditRecord created = {.call = "CreateJob",
                               .peer = "unix:",
                               .owner = "alice",
                               .job_id = "0f",
                               .scan_id = "a1",
                               .request_id = "one"};
  EXPECT_THAT(AuditFields(created, 7),
              ElementsAre(Pair("call", "CreateJob"), Pair("outcome", "OK"), Pair("peer", "unix:"),
                          Pair("owner", "alice"), Pair("job_id", "0f"), Pair("scan_id", "a1"),
                          Pair("request_id", "one"), Pair("left_out", "7")));
}

TEST(AuditLog, ALineIsBounded) {
  const std::string long_text(1'000'000, 'x');
  const AuditRecord record = {.call = "UploadScan",
                              .peer = long_text,
                              .owner = long_text,
                              .outcome = StatusCode::kInvalidArgument,
                              .reason = long_text,
                              .job_id = long_text,
                              .scan_id = long_text,
                              .request_id = long_text,
                              .upload_id = long_text};
  EXPECT_LT(EventJson(TimeOfLine(), "audit", AuditFields(record, 1)).size(), 1000u);
}

}  // namespace
}  // namespace rilievo
