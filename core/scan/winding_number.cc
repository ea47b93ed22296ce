#include "core/scan/winding_number.h"

#include <cmath>
#include <numbers>

namespace rilievo {

double WindingNumber(std::span<const SurfacePatch> patches, const Eigen::Vector3d& position) {
  double sum = 0;
  for (const SurfacePatch& patch : patches) {
    const Eigen::Vector3d offset = patch.center - position;
    const double squared = offset.squaredNorm() + patch.blur;
    if (squared > 0) sum += patch.area.dot(offset) / (squared * std::sqrt(squared));
  }
  return sum * (0.25 * std::numbers::inv_pi);
}

}  // namespace rilievo
