// Eigen sums three numbers as (a + b) + c where it has packets of two doubles, as on every x86-64
// and ARM64, and as a + (b + c) where it has none. Included before every source of this build, so
// that lengths and dot products get the bits they have elsewhere.
#pragma once

#include <Eigen/Core>

namespace Eigen::internal {

template <typename Func, typename Evaluator, int Start>
struct redux_novec_unroller<Func, Evaluator, Start, 3> {
  typedef typename Evaluator::Scalar Scalar;
  static Scalar run(const Evaluator& eval, const Func& func) {
    const Scalar first_two = redux_novec_unroller<Func, Evaluator, Start, 2>::run(eval, func);
    return func(first_two, redux_novec_unroller<Func, Evaluator, Start + 2, 1>::run(eval, func));
  }
};

}  // namespace Eigen::internal
