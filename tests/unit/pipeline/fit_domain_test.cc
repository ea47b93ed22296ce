#include "core/pipeline/fit_domain.h"

#include <gtest/gtest.h>

#include "tests/scans/analytic_shape.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

PreparedScan Prepare(const AnalyticShape& shape) {
  ControlOptions options;
  options.topology = Topology::kArbitrary;
  options.target_faces = 1200;
  return PrepareScan(shape, 30000, 0, options);
}

double LengthOfCreases(const ControlMesh& mesh) {
  double length = 0;
  for (const Crease& crease : mesh.creases) {
    length += (mesh.vertices.col(crease.a) - mesh.vertices.col(crease.b)).norm();
  }
  return length;
}

TEST(FewerFacesTest, AMachinedPartKeepsItsCreases) {
  const PreparedScan box = Prepare(*MakeCutBox());
  ASSERT_TRUE(IsMachined(box.control.mesh));
  const ControlMesh fewer = FewerFaces(box.scan, box.control.mesh, 300, {}).value();
  EXPECT_NEAR(LengthOfCreases(fewer), LengthOfCreases(box.control.mesh),
              0.05 * LengthOfCreases(box.control.mesh));
}

// Bends of a smooth shape that were taken for creases on the finer mesh.
TEST(FewerFacesTest, AFewCreasesElsewhereAreFoundAnew) {
  PreparedScan torus = Prepare(*MakeTorus());
  ASSERT_TRUE(torus.control.mesh.creases.empty());
  const int a = torus.control.mesh.faces(0, 0), b = torus.control.mesh.faces(1, 0);
  torus.control.mesh.creases = {{std::min(a, b), std::max(a, b)}};
  ASSERT_FALSE(IsMachined(torus.control.mesh));
  const ControlMesh fewer = FewerFaces(torus.scan, torus.control.mesh, 300, {}).value();
  EXPECT_TRUE(fewer.creases.empty());
  EXPECT_NEAR(static_cast<double>(fewer.faces.cols()), 300, 2);
}

struct Faces {
  int64_t start, chosen;
};

Faces FacesOf(const AnalyticShape& shape, double noise) {
  const PreparedScan prepared = PrepareScan(shape, 30000, noise);
  const Domain domain = FitFewFaces(prepared.scan, prepared.scan.cloud.median_spacing, {},
                                    prepared.control.mesh, {}, {})
                            .value();
  return {prepared.control.mesh.faces.cols(), domain.fit.control_mesh.faces.cols()};
}

TEST(FitFewFacesTest, ANoisySmoothScanTakesFewerFaces) {
  const Faces faces = FacesOf(*MakeTorus(), 0.002);
  EXPECT_LT(faces.chosen, faces.start / 3);
}

TEST(FitFewFacesTest, ACleanScanKeepsThem) {
  const Faces faces = FacesOf(*MakeTorus(), 0);
  EXPECT_EQ(faces.chosen, faces.start);
}

// Hills of several sizes stand out of this noise: fewer faces would miss them.
TEST(FitFewFacesTest, DetailAboveTheNoiseKeepsThem) {
  const Faces faces = FacesOf(*MakeTerrain(), 0.0004);
  EXPECT_EQ(faces.chosen, faces.start);
}

// What the trial with fewer faces gave up early leaves no trace.
TEST(FitFewFacesTest, KeptFacesAreFittedAsIfAlone) {
  const PreparedScan prepared = PrepareScan(*MakeTerrain(), 30000, 0.0004);
  const Domain domain = FitFewFaces(prepared.scan, prepared.scan.cloud.median_spacing, {},
                                    prepared.control.mesh, {}, {})
                            .value();
  const Domain alone = FitDomain(prepared.scan, prepared.control.mesh, {}, {}).value();
  EXPECT_EQ(domain.fit.control_mesh.vertices, alone.fit.control_mesh.vertices);
  EXPECT_EQ(domain.fit.rounds, alone.fit.rounds);
  EXPECT_EQ(domain.fit.rms_after, alone.fit.rms_after);
}

// A fan of `count` equal faces with edges of `length`.
ControlMesh Strip(int count, double length) {
  ControlMesh mesh;
  mesh.vertices.resize(3, count + 2);
  mesh.faces.resize(3, count);
  const double height = length * 0.8660254037844386;
  for (int v = 0; v < count + 2; ++v) mesh.vertices.col(v) << v * length / 2, (v % 2) * height, 0;
  for (int f = 0; f < count; ++f) mesh.faces.col(f) << f, f + 1 + f % 2, f + 2 - f % 2;
  return mesh;
}

TEST(PositionStepTest, OnASmoothMeshATenthOfItsShortEdges) {
  EXPECT_NEAR(PositionStepFor(Strip(200, 0.02), 1e-4), 2e-3, 1e-12);
  EXPECT_NEAR(PositionStepFor(Strip(200, 0.02), std::nullopt), 2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(Strip(200, 0.2), 1e-4), 5e-3);
  EXPECT_EQ(PositionStepFor(Strip(200, 0.001), 1e-4), 4e-4);
}

TEST(PositionStepTest, OnAMachinedPartWhatTheErrorAllows) {
  ControlMesh mesh = Strip(200, 0.02);
  EXPECT_FALSE(IsMachined(mesh));
  for (int v = 0; v < 20; ++v) mesh.creases.push_back({v, v + 2});
  EXPECT_TRUE(IsMachined(mesh));
  EXPECT_NEAR(PositionStepFor(mesh, 3e-4), 1.2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(mesh, 1e-5), 4e-4);
  EXPECT_NEAR(PositionStepFor(mesh, 1e-2), 2e-3, 1e-12);
  EXPECT_EQ(PositionStepFor(mesh, std::nullopt), 4e-4);
}

}  // namespace
}  // namespace rilievo
