#include "core/pipeline/search_control_faces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/pipeline/coding_error.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

int64_t BytesOf(const CodedSurface& coded) {
  int64_t bytes = 0;
  for (const auto& chunk : coded.encoded.chunks) bytes += static_cast<int64_t>(chunk.size());
  return bytes;
}

TEST(SearchControlFacesTest, AnErrorIsKeptInFewerBytesThanWithTheUsualFaces) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_error = 5e-4;
  ReconstructReport report = prepared.report;
  const CodedSurface best =
      SearchControlFaces(prepared.scan, prepared.control, {}, options, RunContext{}, &report)
          .value();
  EXPECT_LE(std::hypot(report.error.across_rms, best.encoded.height_rms), 5.1e-4);
  EXPECT_EQ(report.control_faces, best.surface.control_mesh.faces.cols());
  ReconstructReport usual = prepared.report;
  const Domain domain =
      FitDomain(prepared.scan, prepared.control, options, RunContext{}, &usual).value();
  const CodedSurface first =
      BuildSurface(prepared.scan, domain, {}, options, RunContext{}, &usual).value();
  EXPECT_LT(2 * BytesOf(best), BytesOf(first));
}

// The step of the control points is chosen with the rest: one that is asked for is taken as it is,
// and a finer one takes more bytes.
TEST(SearchControlFacesTest, TheStepOfTheControlPointsIsSearchedFor) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_error = 1e-3;
  const auto search = [&](ReconstructReport* report) {
    *report = prepared.report;
    return SearchControlFaces(prepared.scan, prepared.control, {}, options, RunContext{}, report)
        .value();
  };
  ReconstructReport report;
  const CodedSurface best = search(&report);
  EXPECT_LE(std::hypot(report.error.across_rms, best.encoded.height_rms), 1.02e-3);
  options.encode.position_step = best.position_step / 2;
  ReconstructReport other;
  const CodedSurface fixed = search(&other);
  EXPECT_EQ(fixed.position_step, options.encode.position_step);
  EXPECT_LT(BytesOf(best), BytesOf(fixed));
}

TEST(SearchControlFacesTest, ASizeIsKeptWithLessErrorThanWithTheUsualFaces) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_bytes = 1200;
  ReconstructReport report = prepared.report;
  const CodedSurface best =
      SearchControlFaces(prepared.scan, prepared.control, {}, options, RunContext{}, &report)
          .value();
  EXPECT_LE(BytesOf(best), 1200);
  EXPECT_LT(std::hypot(OwnError(report, true), best.encoded.height_rms), 5e-4);
}

TEST(SearchControlFacesTest, ASizeThatNoFacesFitIsRefused) {
  PreparedScan prepared = PrepareScan(*MakeTorus(), 8000, 0);
  ReconstructOptions options;
  options.encode.max_bytes = 50;
  EXPECT_EQ(SearchControlFaces(prepared.scan, prepared.control, {}, options, RunContext{},
                               &prepared.report)
                .status()
                .code(),
            absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace rilievo
