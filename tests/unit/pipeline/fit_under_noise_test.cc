#include "core/pipeline/fit_under_noise.h"

#include <gtest/gtest.h>

#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

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
