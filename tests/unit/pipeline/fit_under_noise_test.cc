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

}  // namespace
}  // namespace rilievo
