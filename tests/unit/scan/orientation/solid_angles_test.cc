#include "core/scan/orientation/solid_angles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace rilievo {
namespace {

// So many that the arrays grow, and no multiple of a stretch.
constexpr int kPlaces = 3001;

std::vector<Dipole> ManyDipoles(const Eigen::Vector3d& center) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Dipole> dipoles(kPlaces);
  for (Dipole& dipole : dipoles) {
    for (int k = 0; k < 3; ++k) {
      dipole.position[k] = center[k] + 0.1 * normal(random);
      dipole.area[k] = 1e-4 * normal(random);
    }
    dipole.blur = 1e-5;
  }
  return dipoles;
}

TEST(SolidAnglesTest, TheSumOfEach) {
  const Eigen::Vector3d center(0.3, -0.2, 0.4);
  const std::vector<Dipole> dipoles = ManyDipoles(center);
  DipoleList list(center);
  EXPECT_EQ(list.SolidAngleAt(center), 0);
  std::vector<double> sums(3, 0.0), sizes(3, 0.0);
  const std::vector<Eigen::Vector3d> places = {center, {0.35, -0.2, 0.4}, dipoles[7].position};
  for (const Dipole& dipole : dipoles) {
    list.Add(dipole);
    for (size_t i = 0; i < places.size(); ++i) {
      sums[i] += SolidAngle(dipole, places[i]);
      sizes[i] += std::abs(SolidAngle(dipole, places[i]));
    }
  }
  for (size_t i = 0; i < places.size(); ++i) {
    EXPECT_NEAR(list.SolidAngleAt(places[i]), sums[i], 1e-5 * sizes[i]);
  }
}

TEST(SolidAnglesTest, APointWithoutSpreadSeesNothingOfItself) {
  DipoleList list({1, 2, 3});
  list.Add({{1, 2, 3}, {0, 0, 1}, 0});
  EXPECT_EQ(list.SolidAngleAt({1, 2, 3}), 0);
}

}  // namespace
}  // namespace rilievo
