// Evaluation by the C interface against the C++ library.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "core/codec/container/dss.h"
#include "core/evaluate/closest_point_finder.h"
#include "tests/unit/decoder_c/c_objects.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class CEvaluateTest : public testing::Test {
 protected:
  CEvaluateTest() {
    const std::vector<uint8_t> bytes = Golden("torus_and_sheet_smoothed_v3.dss");
    decoded_ = *DecodeDss(bytes, RunContext());
    surface_ = Decode(bytes);
  }

  Owned<RilievoEvaluator> Evaluator(int smooth) {
    RilievoEvaluator* evaluator = nullptr;
    EXPECT_EQ(rilievo_evaluator_create(surface_.get(), smooth, 1, &evaluator), RILIEVO_OK);
    return Owned<RilievoEvaluator>(evaluator);
  }

  DecodedSurface decoded_;
  SurfacePtr surface_;
};

TEST_F(CEvaluateTest, GivesTheNumbersOfTheCppLibrary) {
  const DisplacedEvaluator expected = *DisplacedEvaluator::Build(decoded_.surface, RunContext());
  const std::vector<uint32_t> faces = {0, 3, 7, 7};
  const std::vector<double> parameters = {0.2, 0.3, 0.5, 0.5, 0, 0.9, 0.25, 0.125};
  for (const int smooth : {0, 1}) {
    std::vector<double> jets(RILIEVO_JET_SIZE * faces.size());
    ASSERT_EQ(rilievo_evaluate(Evaluator(smooth).get(), faces.data(), parameters.data(),
                               faces.size(), 1, jets.data()),
              RILIEVO_OK)
        << rilievo_last_error();
    for (size_t i = 0; i < faces.size(); ++i) {
      const int face = static_cast<int>(faces[i]);
      const double u = parameters[2 * i], v = parameters[2 * i + 1];
      const SurfaceJet jet = smooth ? expected.LimitAt(face, u, v, JetOrder::kSecond)
                                    : expected.At(face, u, v, JetOrder::kSecond);
      const SurfaceShape shape = ShapeOf(jet);
      const Eigen::Vector3d vectors[] = {jet.position, jet.u,  jet.v,       jet.uu,
                                         jet.uv,       jet.vv, shape.normal};
      for (int k = 0; k < 21; ++k) {
        EXPECT_EQ(jets[RILIEVO_JET_SIZE * i + k], vectors[k / 3][k % 3]) << k;
      }
      EXPECT_EQ(jets[RILIEVO_JET_SIZE * i + 21], shape.least_curvature);
      EXPECT_EQ(jets[RILIEVO_JET_SIZE * i + 22], shape.greatest_curvature);
    }
  }
}

TEST_F(CEvaluateTest, FindsThePointsOfTheCppLibrary) {
  const ClosestPointFinder expected = *ClosestPointFinder::Build(decoded_.surface, RunContext());
  const Eigen::Vector3d center = decoded_.surface.frame.center;
  const double step = decoded_.surface.frame.diagonal / 7;
  Eigen::Matrix3Xd places(3, 20);
  for (int i = 0; i < 20; ++i) {
    places.col(i) = center + step * Eigen::Vector3d(std::sin(i), std::cos(2 * i), std::sin(3 * i));
  }
  const std::vector<ClosestPoint> found = *expected.Find(places, RunContext());
  RilievoFinder* made = nullptr;
  ASSERT_EQ(rilievo_finder_create(surface_.get(), 0, 1, &made), RILIEVO_OK);
  const Owned<RilievoFinder> finder(made);
  std::vector<uint32_t> faces(20);
  std::vector<double> parameters(40), distances(20), positions(60);
  ASSERT_EQ(rilievo_find_closest(finder.get(), places.data(), 20, 1, faces.data(),
                                 parameters.data(), distances.data(), positions.data()),
            RILIEVO_OK)
      << rilievo_last_error();
  for (size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(faces[i], static_cast<uint32_t>(found[i].face));
    EXPECT_EQ(parameters[2 * i], found[i].u);
    EXPECT_EQ(parameters[2 * i + 1], found[i].v);
    EXPECT_EQ(distances[i], found[i].distance);
    for (size_t k = 0; k < 3; ++k) EXPECT_EQ(positions[3 * i + k], found[i].position[k]);
  }
  places(1, 3) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(rilievo_find_closest(finder.get(), places.data(), 20, 1, faces.data(),
                                 parameters.data(), distances.data(), positions.data()),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("point 3"));
}

TEST_F(CEvaluateTest, RefusesFacesAndPointersThatAreNotThere) {
  const auto evaluator = Evaluator(0);
  const std::vector<double> parameters = {0.2, 0.3, 0.7, 0.4};
  std::vector<double> jets(2 * RILIEVO_JET_SIZE);
  for (const uint32_t face : {100000u, 0xffffffffu}) {
    EXPECT_EQ(rilievo_evaluate(evaluator.get(), &face, parameters.data(), 1, 1, jets.data()),
              RILIEVO_INVALID_ARGUMENT);
    EXPECT_THAT(rilievo_last_error(), HasSubstr("control faces 0 to"));
  }
  const uint32_t faces[] = {0, 0};
  EXPECT_EQ(rilievo_evaluate(evaluator.get(), faces, parameters.data(), 2, 1, jets.data()),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("parameter 1: u is 0.7"));
  EXPECT_EQ(rilievo_evaluate(evaluator.get(), nullptr, nullptr, 0, 1, nullptr), RILIEVO_OK);
  EXPECT_EQ(rilievo_evaluate(evaluator.get(), faces, parameters.data(), 1, 1, nullptr),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("jets is NULL"));
  EXPECT_EQ(rilievo_evaluator_create(nullptr, 0, 1, nullptr), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_finder_create(surface_.get(), 0, 1, nullptr), RILIEVO_INVALID_ARGUMENT);
  rilievo_evaluator_free(nullptr);
  rilievo_finder_free(nullptr);
}

}  // namespace
}  // namespace rilievo
