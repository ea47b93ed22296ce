#include "core/control/implicit/trilinear_stencil.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/control/implicit/settings.h"

namespace rilievo {

void TangentDisc(const Eigen::Vector3d& normal, double radius, std::vector<Eigen::Vector3d>* disc) {
  std::vector<Eigen::Vector3d>& offsets = *disc;
  offsets.assign(1, Eigen::Vector3d::Zero());
  if (radius < kTrilinearStencil.smallest_disc) return;
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  const int rings = static_cast<int>(std::ceil(radius - 0.25));
  for (int ring = 1; ring <= rings; ++ring) {
    const double r = radius * ring / (rings + 0.5);
    for (int k = 0; k < 6 * ring; ++k) {
      const double angle = 2 * std::numbers::pi * k / (6 * ring);
      offsets.push_back(r * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
}

}  // namespace rilievo
