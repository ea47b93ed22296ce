#include "core/scan/orientation/solid_angles.h"

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

// Squared length below which a dipole that is not spread counts as this far off: it adds nothing.
constexpr float kNowhere = 1e-20f;

RILIEVO_WIDE void AddSolidAngles(const float* const* rows, int count, const float* at,
                                 float* lanes) {
  const float x = at[0], y = at[1], z = at[2];
  for (int i = 0; i < count; i += kWideLanes) {
    for (int k = 0; k < kWideLanes; ++k) {
      const float dx = rows[0][i + k] - x, dy = rows[1][i + k] - y, dz = rows[2][i + k] - z;
      const float squared = dx * dx + dy * dy + dz * dz + rows[6][i + k] + kNowhere;
      const float along = rows[3][i + k] * dx + rows[4][i + k] * dy + rows[5][i + k] * dz;
      lanes[k] += along / (squared * std::sqrt(squared));
    }
  }
}

}  // namespace

DipoleList::DipoleList(const Eigen::Vector3d& center) : center_(center) { Grow(); }

void DipoleList::Grow() {
  constexpr int kFewest = 1024;
  for (std::vector<float>& row : rows_) row.resize(std::max(kFewest, 2 * size()), 0.0f);
}

double DipoleList::SolidAngleAt(const Eigen::Vector3d& position) const {
  std::array<const float*, kRows> rows;
  for (int row = 0; row < kRows; ++row) rows[row] = rows_[row].data();
  const Eigen::Vector3f at = (position - center_).cast<float>();
  std::array<float, kWideLanes> lanes = {};
  AddSolidAngles(rows.data(), count_, at.data(), lanes.data());
  double sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

}  // namespace rilievo
