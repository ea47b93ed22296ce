#include "core/pipeline/search_control_faces.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

absl::StatusOr<CodedSurface> Search(const PreparedScan& prepared,
                                    const ReconstructOptions& options) {
  return SearchControlFaces(prepared.scan, {}, prepared.control, {}, options, {});
}

TEST(SearchControlFacesTest, AnErrorIsKeptInFewerBytesThanWithTheUsualFaces) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_error = 5e-4;
  const CodedSurface best = Search(prepared, options).value();
  EXPECT_LE(std::hypot(best.uncoded.error.across_rms, best.encoded.height_rms), 5.1e-4);
  const Domain usual = FitDomain(prepared.scan, prepared.control.mesh, options, {}).value();
  const CodedSurface first = SampleAndCode(prepared, usual, options).value();
  EXPECT_LT(2 * BytesOf(best.encoded), BytesOf(first.encoded));
}

// The step of the control points is chosen with the rest: one that is asked for is taken as it is,
// and a finer one takes more bytes.
TEST(SearchControlFacesTest, TheStepOfTheControlPointsIsSearchedFor) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_error = 1e-3;
  const CodedSurface best = Search(prepared, options).value();
  EXPECT_LE(std::hypot(best.uncoded.error.across_rms, best.encoded.height_rms), 1.02e-3);
  options.encode.position_step = best.domain.position_step / 2;
  const CodedSurface fixed = Search(prepared, options).value();
  EXPECT_EQ(fixed.domain.position_step, options.encode.position_step);
  EXPECT_LT(BytesOf(best.encoded), BytesOf(fixed.encoded));
}

TEST(SearchControlFacesTest, ASizeIsKeptWithLessErrorThanWithTheUsualFaces) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 20000, 0);
  ReconstructOptions options;
  options.encode.max_bytes = 1200;
  const CodedSurface best = Search(prepared, options).value();
  EXPECT_LE(BytesOf(best.encoded), 1200);
  EXPECT_LT(std::hypot(OwnError(best.uncoded), best.encoded.height_rms), 5e-4);
}

TEST(SearchControlFacesTest, ASizeThatNoFacesFitIsRefused) {
  ReconstructOptions options;
  options.encode.max_bytes = 50;
  EXPECT_TRUE(
      absl::IsResourceExhausted(Search(PrepareScan(*MakeTorus(), 8000, 0), options).status()));
}

}  // namespace
}  // namespace rilievo
