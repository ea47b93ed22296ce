#include "core/pipeline/domain_resolution.h"

#include <gtest/gtest.h>

#include "core/control/build_control_mesh.h"
#include "core/pipeline/position_step.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

struct Prepared {
  ScanSurface scan;
  ControlMesh mesh;
};

Prepared Prepare(const AnalyticShape& shape) {
  ScannerOptions options;
  options.points = 30000;
  options.views = 0;
  ScanSurface scan =
      AnalyzeScan(CheckScan(SimulateScan(shape, options)->cloud, {}, {}).value(), {}, {}).value();
  ControlOptions control;
  control.topology = Topology::kArbitrary;
  control.target_faces = 1200;
  ControlMeshResult result =
      BuildControlMesh(std::move(scan.cloud), scan.graph, scan.index, scan.frame, control, {})
          .value();
  scan.cloud = std::move(result.cloud);
  return {std::move(scan), std::move(result.mesh)};
}

double LengthOfCreases(const ControlMesh& mesh) {
  double length = 0;
  for (const Crease& crease : mesh.creases) {
    length += (mesh.vertices.col(crease.a) - mesh.vertices.col(crease.b)).norm();
  }
  return length;
}

TEST(FewerFacesTest, AMachinedPartKeepsItsCreases) {
  const Prepared box = Prepare(*MakeCutBox());
  ASSERT_TRUE(IsMachined(box.mesh));
  const ControlMesh fewer = FewerFaces(box.scan, box.mesh, 300, {}).value();
  EXPECT_NEAR(LengthOfCreases(fewer), LengthOfCreases(box.mesh), 0.05 * LengthOfCreases(box.mesh));
}

// Bends of a smooth shape that were taken for creases on the finer mesh.
TEST(FewerFacesTest, AFewCreasesElsewhereAreFoundAnew) {
  Prepared torus = Prepare(*MakeTorus());
  ASSERT_TRUE(torus.mesh.creases.empty());
  const int a = torus.mesh.faces(0, 0), b = torus.mesh.faces(1, 0);
  torus.mesh.creases = {{std::min(a, b), std::max(a, b)}};
  ASSERT_FALSE(IsMachined(torus.mesh));
  const ControlMesh fewer = FewerFaces(torus.scan, torus.mesh, 300, {}).value();
  EXPECT_TRUE(fewer.creases.empty());
  EXPECT_NEAR(static_cast<double>(fewer.faces.cols()), 300, 2);
}

struct Faces {
  int64_t start, chosen;
};

Faces FacesOf(const AnalyticShape& shape, double noise) {
  PreparedScan prepared = PrepareScan(shape, 30000, noise);
  const Domain domain = FitUnderNoise(prepared.scan, prepared.control, ReconstructOptions{},
                                      RunContext{}, &prepared.report)
                            .value();
  return {prepared.control.faces.cols(), domain.mesh.faces.cols()};
}

TEST(FitUnderNoiseTest, ANoisySmoothScanTakesFewerFaces) {
  const Faces faces = FacesOf(*MakeTorus(), 0.002);
  EXPECT_LT(faces.chosen, faces.start / 3);
}

TEST(FitUnderNoiseTest, ACleanScanKeepsThem) {
  const Faces faces = FacesOf(*MakeTorus(), 0);
  EXPECT_EQ(faces.chosen, faces.start);
}

// Hills of several sizes stand out of this noise: fewer faces would miss them.
TEST(FitUnderNoiseTest, DetailAboveTheNoiseKeepsThem) {
  const Faces faces = FacesOf(*MakeTerrain(), 0.0004);
  EXPECT_EQ(faces.chosen, faces.start);
}

// What the trial with fewer faces gave up early leaves no trace.
TEST(FitUnderNoiseTest, KeptFacesAreFittedAsIfAlone) {
  PreparedScan prepared = PrepareScan(*MakeTerrain(), 30000, 0.0004);
  ReconstructReport alone_report = prepared.report;
  const Domain domain = FitUnderNoise(prepared.scan, prepared.control, ReconstructOptions{},
                                      RunContext{}, &prepared.report)
                            .value();
  const Domain alone =
      FitDomain(prepared.scan, prepared.control, ReconstructOptions{}, RunContext{}, &alone_report)
          .value();
  EXPECT_EQ(domain.mesh.vertices, alone.mesh.vertices);
  EXPECT_EQ(prepared.report.fit_rounds, alone_report.fit_rounds);
  EXPECT_EQ(prepared.report.domain_rms, alone_report.domain_rms);
}

}  // namespace
}  // namespace rilievo
