#include "server/observability/server_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace rilievo {
namespace {

using testing::HasSubstr;
using testing::Not;

grpc::Status Refused(const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_reason(reason);
  google::rpc::Status details;
  details.add_details()->PackFrom(info);
  return grpc::Status(grpc::StatusCode::UNAUTHENTICATED, "no", details.SerializeAsString());
}

TEST(ServerMetrics, CountsJobsByKindAndStatusAndTheirStages) {
  ServerMetrics metrics;
  JobRecord record;
  record.work_seconds = 2;
  record.stage_seconds = {{"check", 0.02}, {"normals", 1.5}};
  metrics.CountJob(record);
  metrics.CountJob(record);
  record.id.assign(8, 'x');
  record.code = absl::StatusCode::kCancelled;
  record.stage_seconds.clear();
  metrics.CountAttempt(record);
  record.code = absl::StatusCode::kAborted;
  metrics.CountAttempt(record);
  metrics.CountAttempt(record);
  metrics.CountKeptJob(absl::StatusCode::kCancelled);
  const std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("rilievo_jobs_ended_total{kind=\"call\",status=\"OK\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_attempts_ended_total{status=\"CANCELLED\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_attempts_ended_total{status=\"ABORTED\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_job_seconds_count{kind=\"kept\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_jobs_ended_total{kind=\"kept\",status=\"CANCELLED\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_stage_seconds_bucket{stage=\"normals\",le=\"1\"} 0\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_stage_seconds_bucket{stage=\"normals\",le=\"3\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_stage_seconds_sum{stage=\"normals\"} 3\n"));
}

TEST(ServerMetrics, CountsRefusalsByTheirReason) {
  ServerMetrics metrics;
  metrics.CountCall("/rilievo.v1.JobsService/GetJob", Refused("WRONG_TOKEN"));
  metrics.CountCall("/rilievo.v1.JobsService/GetJob", grpc::Status::OK);
  for (const char* made : {"/made/up", "/made/up2", ""}) metrics.CountCall(made, grpc::Status::OK);
  const std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("rilievo_refusals_total{reason=\"WRONG_TOKEN\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_calls_total{code=\"UNAUTHENTICATED\",method=\"/rilievo.v1."
                              "JobsService/GetJob\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rilievo_calls_total{code=\"OK\",method=\"other\"} 3\n"));
  EXPECT_THAT(text, Not(HasSubstr("made"))) << "clients choose no names";
}

TEST(ServerMetrics, AsksForTheStateWhenItIsCollected) {
  ServerMetrics metrics;
  int asked = 0;
  metrics.Watch([&] {
    ++asked;
    return ServerState{3, 2, 4.5, 7, 9, 11};
  });
  metrics.CountReceived(10);
  metrics.CountReceived(32);
  metrics.CountSent(5);
  metrics.CountRefusedConnection("ALL");
  const std::string text = metrics.Text();
  EXPECT_EQ(asked, 1);
  for (const char* line :
       {"rilievo_jobs{state=\"queued\"} 3\n", "rilievo_jobs{state=\"running\"} 2\n",
        "rilievo_queue_oldest_seconds 4.5\n", "rilievo_streams 7\n", "rilievo_connections 11\n",
        "rilievo_connections_refused_total{reason=\"ALL\"} 1\n",
        "rilievo_refusals_total{reason=\"OTHER_OWNER\"} 9\n", "rilievo_received_bytes_total 42\n",
        "rilievo_sent_bytes_total 5\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
  EXPECT_THAT(text, Not(HasSubstr("process_resident_memory_bytes 0\n")));
  metrics.Watch({});
  metrics.Text();
  EXPECT_EQ(asked, 1);
}

}  // namespace
}  // namespace rilievo
