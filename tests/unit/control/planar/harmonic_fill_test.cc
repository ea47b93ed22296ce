#include "core/control/planar/harmonic_fill.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

TEST(HarmonicFill, ContinuesALinearFunctionOverARegularMesh) {
  const ControlMesh mesh = Sheet(11, 11, false, [](double s, double t) -> Eigen::Vector3d {
    return {s, t, 0};
  });
  const Eigen::VectorXd truth =
      (2 * mesh.vertices.row(0) - 3 * mesh.vertices.row(1)).transpose().array() + 1;
  std::vector<uint8_t> known(121, 1);
  Eigen::VectorXd values = truth;
  for (int r = 3; r < 8; ++r) {
    for (int c = 3; c < 8; ++c) {
      known[r * 11 + c] = 0;
      values[r * 11 + c] = -99;
    }
  }
  HarmonicFill(mesh.faces, known, &values);
  EXPECT_LT((values - truth).cwiseAbs().maxCoeff(), 1e-7);
}

TEST(HarmonicFill, UsesTheMeanWhereNothingIsKnown) {
  ControlMesh mesh = Sheet(3, 3, false, [](double s, double t) -> Eigen::Vector3d {
    return {s, t, 0};
  });
  Eigen::Matrix3Xi two(3, 2 * mesh.faces.cols());
  two << mesh.faces, (mesh.faces.array() + 9).matrix();
  std::vector<uint8_t> known(18, 0);
  Eigen::VectorXd values = Eigen::VectorXd::Zero(18);
  known[0] = known[8] = 1;
  values[0] = 1;
  values[8] = 3;
  HarmonicFill(two, known, &values);
  EXPECT_EQ(values[0], 1);
  EXPECT_EQ(values[8], 3);
  for (int v = 1; v < 8; ++v) {
    EXPECT_GT(values[v], 1);
    EXPECT_LT(values[v], 3);
  }
  for (int v = 9; v < 18; ++v) EXPECT_NEAR(values[v], 2, 1e-6);
}

}  // namespace
}  // namespace rilievo
