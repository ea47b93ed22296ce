// The search of Kernighan and Lin for signs.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// One pass of Kernighan and Lin 1970: turns each node once, always the one that gains most or
// loses least, and keeps the best of the states on the way. Returns what was gained: a quarter
// of the growth of signs' weights signs.
// `weights`: symmetric, diagonal 0; > 0: same sign, < 0: opposite. `signs`: +1 or -1 by node.
double KernighanLinPass(const Eigen::MatrixXd& weights, Eigen::VectorXd* signs);

}  // namespace rilievo
