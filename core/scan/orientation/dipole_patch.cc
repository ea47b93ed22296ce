#include "core/scan/orientation/dipole_patch.h"

#include <Eigen/Core>
#include <algorithm>
#include <utility>

#include "core/scan/orientation/winding_number.h"

namespace rilievo {

DipolePatch MakeDipolePatch(const OrientedCloud& cloud, std::span<const int> points,
                            std::vector<int> patches) {
  DipolePatch face;
  face.patches = std::move(patches);
  for (const int i : points) {
    const Dipole dipole = DipoleOf(cloud, i);
    const double share = ShareOfSurface(cloud.spacing[i]);
    face.sum.position += share * dipole.position;
    face.sum.area += dipole.area;
    face.sum.blur += share * dipole.blur;
    face.size += share;
    face.points.push_back(dipole);
  }
  if (face.size > 0) {
    face.sum.position /= face.size;
    face.sum.blur /= face.size;
  }
  for (const Dipole& dipole : face.points) {
    face.radius = std::max(face.radius, (dipole.position - face.sum.position).norm());
  }
  return face;
}

double Agreement(const DipolePatch& a, const DipolePatch& b) {
  const double near = kFarRadii * (a.radius + b.radius);
  if ((b.sum.position - a.sum.position).squaredNorm() > near * near) {
    return Agreement(a.sum, b.sum);
  }
  double sum = 0;
  for (const Dipole& i : a.points) {
    for (const Dipole& j : b.points) sum += Agreement(i, j);
  }
  return sum;
}

bool Touch(const DipolePatch& a, const DipolePatch& b) {
  const double reach = a.radius + b.radius;
  return (b.sum.position - a.sum.position).squaredNorm() < reach * reach;
}

}  // namespace rilievo
