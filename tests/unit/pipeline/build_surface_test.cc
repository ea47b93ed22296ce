#include "core/pipeline/build_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

TEST(ReliefTest, TheDomainIsRoundedAndTheFileHoldsTheRelief) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  ReconstructOptions options;
  options.encode.position_step = 1e-3;
  const Domain domain =
      FitDomain(prepared.scan, prepared.control, options, RunContext{}, &prepared.report).value();
  EXPECT_EQ(domain.position_step, 1e-3);
  EXPECT_EQ(prepared.report.control_faces, prepared.control.faces.cols());
  const double step = 1e-3, off = domain.mesh.vertices(0, 0) / step;
  EXPECT_NEAR(off, std::round(off), 0.2);  // the stored step has 12 binary digits
  const CodedSurface coded =
      BuildSurface(prepared.scan, domain, {}, options, RunContext{}, &prepared.report).value();
  const DecodedSurface decoded = DecodeDss(coded.encoded.Concatenate(), RunContext{}).value();
  EXPECT_EQ(decoded.surface.control_mesh.vertices, domain.mesh.vertices);
  EXPECT_EQ(decoded.surface.heights.size(), coded.surface.heights.size());
  EXPECT_LT(prepared.report.error.b_to_a.rms, 1e-3);
  EXPECT_EQ(prepared.report.surface_vertices, static_cast<int64_t>(coded.surface.heights.size()));
}

TEST(ReliefTest, ADomainIsRoundedAgainFromWhatWasFitted) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  ReconstructOptions options;
  options.encode.position_step = 1e-3;
  const Domain first =
      FitDomain(prepared.scan, prepared.control, options, RunContext{}, &prepared.report).value();
  const Domain coarser = RoundDomain(first.fitted, 4e-3).value();
  EXPECT_EQ(coarser.position_step, 4e-3);
  EXPECT_EQ(coarser.mesh.faces, first.mesh.faces);
  EXPECT_LE((coarser.mesh.vertices - first.mesh.vertices).cwiseAbs().maxCoeff(), 2.51e-3);
  EXPECT_EQ(RoundDomain(first.fitted, 1e-3)->mesh.vertices, first.mesh.vertices);
}

TEST(ReliefTest, ASizeBelowTheControlMeshIsRefused) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  ReconstructOptions options;
  options.encode.max_bytes = 100;
  const Domain domain =
      FitDomain(prepared.scan, prepared.control, options, RunContext{}, &prepared.report).value();
  EXPECT_EQ(BuildSurface(prepared.scan, domain, {}, options, RunContext{}, &prepared.report)
                .status()
                .code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace rilievo
