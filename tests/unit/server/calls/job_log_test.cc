#include "server/calls/job_log.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace rilievo
