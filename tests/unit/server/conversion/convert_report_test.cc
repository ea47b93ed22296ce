#include <gtest/gtest.h>

#include "server/conversion/job_report.h"

namespace rilievo {
namespace {

TEST(ProtoReport, EveryFieldArrivesDistinct) {
  ReconstructReport report;
  report.points_in = 1;
  report.non_finite = 2;
  report.duplicates = 3;
  report.strays = 4;
  report.outliers = 5;
  report.island_points = 6;
  report.foliage_points = 65;
  report.points_used = 7;
  report.diagonal = 8;
  report.median_spacing = 9;
  report.median_noise = 10;
  report.normal_disagreement = 11;
  report.topology = "planar";
  report.topology_reason = "flat";
  report.components = 14;
  report.boundary_loops = 15;
  report.genus = 16;
  report.control_vertices = 17;
  report.control_faces = 18;
  report.max_level = 19;
  report.surface_vertices = 20;
  report.surface_faces = 21;
  report.domain_rms = 22;
  report.fit_rounds = 23;
  report.fit_converged = true;
  report.heights_measured = 25;
  report.heights_smoothed = 26;
  report.heights_filled = 27;
  report.error = {{31, 32, 33, 34, 35}, {41, 42, 43, 44, 45}, 51, 52, 53, 54, 55};
  report.max_error = 50;
  report.place = {0.3048, UpDirection::kZ, "EPSG:2992"};
  report.error_unreachable = true;
  report.encoded_bytes = 29;
  for (int i = 0; i < kStageCount; ++i) report.stage_seconds[i] = 100 + i;
  report.total_seconds = 61;
  report.warnings = {"one", "two"};
  report.mesh = {71, 72, 73, 74, 75, 76};

  const v1::ReconstructReport proto = ProtoReport(report, /*measured=*/true);
  EXPECT_EQ(proto.place().metres_per_unit(), 0.3048);
  EXPECT_EQ(proto.place().up(), v1::UP_DIRECTION_Z);
  EXPECT_EQ(proto.place().crs(), "EPSG:2992");
  EXPECT_FALSE(ProtoReport({}, true).has_place());
  EXPECT_EQ(proto.mesh().triangles(), 71);
  EXPECT_EQ(proto.mesh().welded_vertices(), 72);
  EXPECT_EQ(proto.mesh().dropped(), 73);
  EXPECT_EQ(proto.mesh().flipped(), 74);
  EXPECT_EQ(proto.mesh().opened_edges(), 75);
  EXPECT_EQ(proto.mesh().triangles_used(), 76);
  EXPECT_FALSE(ProtoReport({}, true).has_mesh()) << "of a scan";
  EXPECT_EQ(proto.points_in(), 1);
  EXPECT_EQ(proto.non_finite(), 2);
  EXPECT_EQ(proto.duplicates(), 3);
  EXPECT_EQ(proto.strays(), 4);
  EXPECT_EQ(proto.outliers(), 5);
  EXPECT_EQ(proto.island_points(), 6);
  EXPECT_EQ(proto.foliage_points(), 65);
  EXPECT_EQ(proto.points_used(), 7);
  EXPECT_EQ(proto.diagonal(), 8);
  EXPECT_EQ(proto.median_spacing_ratio(), 9);
  EXPECT_EQ(proto.median_noise_ratio(), 10);
  EXPECT_EQ(proto.normal_disagreement(), 11);
  EXPECT_EQ(proto.road(), "planar");
  EXPECT_EQ(proto.road_reason(), "flat");
  EXPECT_EQ(proto.components(), 14);
  EXPECT_EQ(proto.boundary_loops(), 15);
  EXPECT_EQ(proto.genus(), 16);
  EXPECT_EQ(proto.control_vertices(), 17);
  EXPECT_EQ(proto.control_faces(), 18);
  EXPECT_EQ(proto.max_level(), 19);
  EXPECT_EQ(proto.surface_vertices(), 20);
  EXPECT_EQ(proto.surface_faces(), 21);
  EXPECT_EQ(proto.domain_rms_ratio(), 22);
  EXPECT_EQ(proto.fit_rounds(), 23);
  EXPECT_TRUE(proto.fit_converged());
  EXPECT_EQ(proto.heights_measured(), 25);
  EXPECT_EQ(proto.heights_smoothed(), 26);
  EXPECT_EQ(proto.heights_filled(), 27);
  EXPECT_EQ(proto.error().surface_to_points().rms(), 31);
  EXPECT_EQ(proto.error().surface_to_points().mean(), 32);
  EXPECT_EQ(proto.error().surface_to_points().p95(), 33);
  EXPECT_EQ(proto.error().surface_to_points().max(), 34);
  EXPECT_EQ(proto.error().surface_to_points().samples(), 35);
  EXPECT_EQ(proto.error().points_to_surface().rms(), 41);
  EXPECT_EQ(proto.error().points_to_surface().samples(), 45);
  EXPECT_EQ(proto.error().rms(), 51);
  EXPECT_EQ(proto.error().mean(), 52);
  EXPECT_EQ(proto.error().p95(), 53);
  EXPECT_EQ(proto.error().max(), 54);
  EXPECT_EQ(proto.error().rms_across(), 55);
  EXPECT_TRUE(proto.has_max_error_kept());
  EXPECT_FALSE(proto.max_error_kept());
  EXPECT_EQ(proto.encoded_bytes(), 29);
  ASSERT_EQ(proto.stage_times_size(), kStageCount);
  EXPECT_EQ(proto.stage_times(0).stage(), v1::STAGE_CHECK);
  EXPECT_EQ(proto.stage_times(7).stage(), v1::STAGE_ENCODE);
  EXPECT_EQ(proto.stage_times(7).seconds(), 107);
  EXPECT_EQ(proto.total_seconds(), 61);
  ASSERT_EQ(proto.warnings_size(), 2);
  EXPECT_EQ(proto.warnings(1), "two");
}

TEST(ProtoReport, NoErrorWhenNotMeasured) {
  EXPECT_FALSE(ProtoReport({}, /*measured=*/false).has_error());
  ReconstructReport asked;
  asked.max_error = 1e-3;
  EXPECT_TRUE(ProtoReport(asked, /*measured=*/true).has_max_error_kept());
  EXPECT_FALSE(ProtoReport(asked, /*measured=*/false).has_max_error_kept());
}

// The protocol's names are the core's: "STAGE_CONTROL_MESH" is "control-mesh".
TEST(ProtoStage, NamesAgreeWithTheCores) {
  for (int i = 0; i < kStageCount; ++i) {
    const auto stage = static_cast<Stage>(i);
    std::string expected = "STAGE_";
    for (const char* c = StageName(stage); *c != '\0'; ++c) {
      expected += *c == '-' ? '_' : static_cast<char>(std::toupper(*c));
    }
    EXPECT_EQ(v1::Stage_Name(ProtoStage(stage)), expected);
  }
}

}  // namespace
}  // namespace rilievo
