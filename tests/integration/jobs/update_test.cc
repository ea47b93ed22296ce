// Surfaces brought up to date by a server: at once, and as kept jobs.
#include "core/codec/container/dss.h"
#include "core/pipeline/update_surface.h"
#include "tests/integration/jobs/jobs_fixture.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class UpdateJobsTest : public JobsTest {
 protected:
  void SetUp() override {
    StartServer();
    const PointCloud scan = SphereScan(2'000);
    base_.dss = Expected(scan);
    base_.vertices = static_cast<int64_t>(DecodeDss(base_.dss, {})->surface.heights.size());
    scan_ = scan;
    for (auto point : scan_.points.colwise()) {
      if (point[2] > 0.8) point *= 1.02;
    }
    expected_ = *UpdateSurface(base_.dss, scan_, {}, {});
    ASSERT_GT(expected_.report.update_bytes, 0);
  }

  absl::Status StatusOfUpdate(const PointCloud& scan, const UpdatedSurface& base) const {
    return ReconstructionClient(Channel()).Update(scan, base).status();
  }

  UpdatedSurface base_;
  PointCloud scan_;  // of what it became
  SurfaceUpdate expected_;
};

TEST_F(UpdateJobsTest, OnlyWhatIsNewComesBack) {
  std::string pieces;
  ReconstructCallbacks callbacks;
  callbacks.piece = [&](const v1::SurfacePiece& piece) { pieces += piece.data(); };
  const auto result = ReconstructionClient(Channel()).Update(scan_, base_, callbacks);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->dss, expected_.dss);
  EXPECT_EQ(result->chunk_bytes, expected_.chunk_bytes);
  EXPECT_EQ(static_cast<int64_t>(pieces.size()), expected_.report.update_bytes);
  const v1::UpdateReport& report = result->report.update();
  EXPECT_EQ(report.points(), scan_.points.cols());
  EXPECT_EQ(report.points_contradicting(), expected_.report.contradicting);
  EXPECT_EQ(report.heights_anew(), expected_.report.heights_anew);
  EXPECT_EQ(report.points_to_surface().rms(), expected_.report.after.rms);
  EXPECT_EQ(report.update_bytes(), expected_.report.update_bytes);
  // Once more, when nothing is new.
  pieces.clear();
  base_.dss = result->dss;
  const auto again = ReconstructionClient(Channel()).Update(scan_, base_, callbacks);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->dss, expected_.dss);
  EXPECT_EQ(pieces, "");
}

TEST_F(UpdateJobsTest, AWholeScanSaysWhereNothingIs) {
  std::vector<int> half;
  for (Eigen::Index i = 0; i < scan_.points.cols(); ++i) {
    if (scan_.points(0, i) > 0) half.push_back(static_cast<int>(i));
  }
  const PointCloud scan{Eigen::Matrix3Xd(scan_.points(Eigen::all, half))};
  base_.whole = true;
  const auto result = ReconstructionClient(Channel()).Update(scan, base_);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_GT(result->report.update().heights_filled(), 100);
  EXPECT_EQ(result->dss, UpdateSurface(base_.dss, scan, {.whole = true}, {})->dss);
}

TEST_F(UpdateJobsTest, AKeptJobIsFetchedFromWhereTheSurfaceEnded) {
  const auto job = Client().Submit(PackUpdate(scan_, base_), {}, "update");
  ASSERT_TRUE(job.ok()) << job.status();
  const auto done = Client().Watch(job->job_id());
  ASSERT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED) << done->error().message();
  EXPECT_EQ(done->report().update().update_bytes(), expected_.report.update_bytes);
  std::string pieces;
  const auto surface = Client().Fetch(
      job->job_id(), [&](const v1::SurfacePiece& piece) { pieces += piece.data(); }, {}, base_.dss);
  ASSERT_TRUE(surface.ok()) << surface.status();
  EXPECT_EQ(*surface, expected_.dss);
  EXPECT_EQ(static_cast<int64_t>(pieces.size()), expected_.report.update_bytes);
  EXPECT_EQ(*Client().Fetch(job->job_id()), expected_.dss);
  std::vector<uint8_t> other = base_.dss;
  other[100] ^= 1;
  EXPECT_TRUE(absl::IsDataLoss(HastyClient().Fetch(job->job_id(), {}, {}, other).status()));
}

TEST_F(UpdateJobsTest, WhatCannotBeBroughtUpToDateIsSaid) {
  UpdatedSurface wrong = base_;
  wrong.dss[wrong.dss.size() / 2] ^= 1;
  EXPECT_THAT(StatusOfUpdate(scan_, wrong).ToString(), HasSubstr("INVALID_ARGUMENT: base: "));
  wrong = base_;
  wrong.vertices -= 1;
  EXPECT_THAT(
      StatusOfUpdate(scan_, wrong).ToString(),
      HasSubstr(absl::StrCat("base: the surface has ", base_.vertices, " vertices or more")));
  // Told by the header, before there is a mesh of it.
  wrong.vertices = 1;
  EXPECT_THAT(StatusOfUpdate(scan_, wrong).ToString(), HasSubstr("vertices or more, and 1 are"));
  UpdatedSurface newer = base_;
  newer.dss[8] = 99;
  EXPECT_THAT(StatusOfUpdate(scan_, newer).ToString(),
              HasSubstr("base: the stream has format version 99"));
  wrong.vertices = 0;
  EXPECT_THAT(StatusOfUpdate(scan_, wrong).ToString(),
              HasSubstr("header.base_surface.vertices: 0;"));
  EXPECT_THAT(StatusOfUpdate({Eigen::Matrix3Xd::Constant(3, 5, NAN)}, base_).ToString(),
              HasSubstr("points: the scan has no point with finite"));
  PointCloud far = scan_;
  far.points.array() += 50;
  const absl::Status elsewhere = StatusOfUpdate(far, base_);
  EXPECT_TRUE(absl::IsFailedPrecondition(elsewhere)) << elsewhere;
  EXPECT_THAT(elsewhere.ToString(), HasSubstr("bring the scan into the frame"));
  v1::ReconstructOptions options;
  options.set_max_level(3);
  const absl::Status asked =
      HastyClient().Submit(PackUpdate(scan_, base_), options, "with").status();
  EXPECT_THAT(asked.ToString(), HasSubstr("header.options: set, but a surface"));
}

}  // namespace
}  // namespace rilievo
