#include "core/scan/orientation/dipole_patch.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "core/scan/orientation/winding_number.h"

namespace rilievo {

DipolePatch MakeDipolePatch(const OrientedCloud& cloud, std::span<const int> points,
                            std::vector<int> patches) {
  const auto dipole_of = [&cloud](int i) { return DipoleOf(cloud, i); };
  DipolePatch face{SumOfDipoles(cloud, points, dipole_of), std::move(patches), {}};
  face.points.reserve(points.size());
  for (const int i : points) face.points.push_back(dipole_of(i));
  return face;
}

double Agreement(const DipolePatch& a, const DipolePatch& b) {
  return AreFar(a, b) ? Agreement(a.sum, b.sum)
                      : Agreement(std::span(a.points), std::span(b.points));
}

bool Touch(const DipolePatch& a, const DipolePatch& b) {
  const double reach = a.radius + b.radius;
  return (b.sum.position - a.sum.position).squaredNorm() < reach * reach;
}

}  // namespace rilievo
