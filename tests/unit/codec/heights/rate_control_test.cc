#include "core/codec/heights/rate_control.h"

#include <cmath>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

class RateControlTest : public ::testing::Test {
 protected:
  const DisplacedSurface surface_ = SurfaceOver(Torus(12, 8), 4, 1e-4, 1e-4);
  const LoopRefinement refinement_ = *RefineTopology(surface_.control_mesh, 3, RunContext());
  const HeightEncoder encoder_{surface_, refinement_, 16};
};

TEST_F(RateControlTest, ErrorIsKeptAndUsed) {
  for (double rms : {1e-5, 3e-5, 1e-4, 3e-4}) {
    const auto encoded = EncodeWithinError(encoder_, rms, 0, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    EXPECT_LE(encoded->rms, rms);
    EXPECT_GE(encoded->rms, 0.9 * rms);
  }
}

// The first rounds of a step tell where the search for one begins.
TEST_F(RateControlTest, FirstRoundsAreThoseOfTheEncoding) {
  const double step = 1e-4;
  const auto rounds = encoder_.RmsOfRounds(step, 3, RunContext());
  ASSERT_TRUE(rounds.ok()) << rounds.status();
  ASSERT_EQ(rounds->size(), 3u);
  EXPECT_LT((*rounds)[1], (*rounds)[0]);
  EXPECT_EQ((*rounds)[2], encoder_.Encode(step, RunContext())->rms);
  EXPECT_EQ(encoder_.RmsOfRounds(step, 1, RunContext())->front(), rounds->front());
}

// Four times the error, the guess that is the same for all surfaces, is farther off.
TEST_F(RateControlTest, TheStepFoundHasAboutTheErrorAskedFor) {
  const auto off = [&](double step, double rms) {
    return std::abs(encoder_.Encode(step, RunContext())->rms / rms - 0.985);
  };
  for (double rms : {1e-5, 2e-5, 3e-5}) {
    const auto step = FindStep(encoder_, rms, RunContext());
    ASSERT_TRUE(step.ok()) << step.status();
    EXPECT_LT(off(*step, rms), 0.05) << rms;
    EXPECT_GT(off(4 * rms, rms), off(*step, rms)) << rms;
  }
}

// Heights vanish when the error allowed is larger than they are.
TEST_F(RateControlTest, AnyLargeErrorIsKept) {
  for (const double rms : {0.01, 0.1}) {
    const auto step = FindStep(encoder_, rms, RunContext());
    ASSERT_TRUE(step.ok()) << step.status();
    EXPECT_EQ(*step, 0.25) << "the coarsest";
  }
  const auto encoded = EncodeWithinError(encoder_, 0.1, 0, RunContext());
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  EXPECT_LT(encoded->bytes(), 200);
}

TEST_F(RateControlTest, LeastStepGoesBeforeTheError) {
  const auto encoded = EncodeWithinError(encoder_, 1e-7, 1e-4, RunContext());
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  EXPECT_EQ(encoded->step, 1e-4);
}

// An error that no step reaches is not paid for: the integers of the format end somewhere.
TEST_F(RateControlTest, GivesUpWhereFinerStepsDoNotHelp) {
  const auto encoded = EncodeWithinError(encoder_, 1e-12, 0, RunContext());
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  const auto finer = encoder_.Encode(encoded->step / 3, RunContext());
  EXPECT_GT(finer->rms, 0.9 * encoded->rms);
}

TEST_F(RateControlTest, BytesAreKeptAndUsed) {
  for (int64_t bytes : {300, 1000, 3000, 20000}) {
    const auto encoded = EncodeWithinBytes(encoder_, bytes, 8, 0, RunContext());
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    const int64_t total = encoded->bytes() + 8 * 5;
    EXPECT_LE(total, bytes);
    EXPECT_GE(total, 0.9 * bytes);
  }
  EXPECT_EQ(EncodeWithinBytes(encoder_, 10, 8, 0, RunContext()).status().code(),
            absl::StatusCode::kResourceExhausted);
  const auto floored = EncodeWithinBytes(encoder_, 1000000, 8, 1e-3, RunContext());
  ASSERT_TRUE(floored.ok()) << floored.status();
  EXPECT_EQ(floored->step, 1e-3);
}

}  // namespace
}  // namespace rilievo
