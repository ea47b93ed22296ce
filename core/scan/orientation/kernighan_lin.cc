#include "core/scan/orientation/kernighan_lin.h"

#include <cstdint>
#include <vector>

namespace rilievo {

double KernighanLinPass(const Eigen::MatrixXd& weights, Eigen::VectorXd* signs) {
  const int64_t count = weights.rows();
  Eigen::VectorXd turned = *signs, best = *signs;
  Eigen::VectorXd against = -(weights * turned).cwiseProduct(turned);  // half the gain of a turn
  std::vector<uint8_t> locked(static_cast<size_t>(count), 0);
  double gain = 0, best_gain = 0;
  for (int64_t step = 0; step < count; ++step) {
    int64_t next = -1;
    for (int64_t i = 0; i < count; ++i) {
      if (locked[i] == 0 && (next < 0 || against[i] > against[next])) next = i;
    }
    gain += against[next];
    locked[next] = 1;
    turned[next] = -turned[next];
    against += 2 * turned[next] * weights.col(next).cwiseProduct(-turned);
    against[next] = -(weights.col(next).dot(turned)) * turned[next];
    if (gain > best_gain) {
      best_gain = gain;
      best = turned;
    }
  }
  *signs = best;
  return best_gain;
}

}  // namespace rilievo
