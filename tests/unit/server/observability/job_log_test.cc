#include "server/observability/job_log.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace rilievo {
namespace {

TEST(JobLine, HoldsTheFigures) {
  JobRecord record;
  record.job = 7;
  record.points_announced = 100000;
  record.bytes_in = 1200000;
  record.bytes_out = 20000;
  record.upload_seconds = 0.25;
  record.work_seconds = 2.5;
  record.total_seconds = 2.7504;
  record.road = "planar";
  EXPECT_EQ(JobLine(record),
            "job=7 status=OK points=100000 bytes_in=1200000 bytes_out=20000 upload_s=0.250 "
            "queue_s=0.000 work_s=2.500 total_s=2.750 road=planar");
}

TEST(JobLine, DetailCannotForgeALine) {
  JobRecord record;
  record.code = absl::StatusCode::kInvalidArgument;
  record.detail = "bad \"x\"\njob=8 status=OK\x1b[31m";
  const std::string line = JobLine(record);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  EXPECT_EQ(line.find('\x1b'), std::string::npos);
  EXPECT_NE(line.find("status=INVALID_ARGUMENT"), std::string::npos);
  EXPECT_NE(line.find("detail=\"bad ?x??job=8 status=OK?[31m\""), std::string::npos);
}

TEST(JobJson, IsOneObjectOnOneLine) {
  JobRecord record;
  record.job = 7;
  record.id = "abc";
  record.owner = "alice";
  record.code = absl::StatusCode::kResourceExhausted;
  record.detail = "two\nlines, \"quotes\" and \xff";
  record.points_announced = 100;
  record.work_seconds = 1.23456;
  record.stage_seconds = {{"check", 0.5}};
  record.trace_id = "4bf92f3577b34da6a3ce929d0e0e4736";
  const std::string line = JobJson(record, "2026-01-31T12:00:00Z");
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto json = nlohmann::json::parse(line);
  EXPECT_EQ(json["time"], "2026-01-31T12:00:00Z");
  EXPECT_EQ(json["event"], "job");
  EXPECT_EQ(json["job"], 7);
  EXPECT_EQ(json["status"], "RESOURCE_EXHAUSTED");
  EXPECT_EQ(json["owner"], "alice");
  EXPECT_EQ(json["work_s"], 1.235);
  EXPECT_EQ(json["stages"]["check"], 0.5);
  EXPECT_EQ(json["trace_id"], record.trace_id);
  EXPECT_FALSE(json.contains("road")) << "what is empty is left out";
  EXPECT_FALSE(json.contains("parent_id"));
}

TEST(SecondsByStage, NamesAreThoseOfTheProtocol) {
  v1::ReconstructReport report;
  auto* time = report.add_stage_times();
  time->set_stage(v1::STAGE_CONTROL_MESH);
  time->set_seconds(2);
  EXPECT_EQ(SecondsByStage(report),
            (std::vector<std::pair<std::string, double>>{{"control_mesh", 2.0}}));
}

}  // namespace
}  // namespace rilievo
