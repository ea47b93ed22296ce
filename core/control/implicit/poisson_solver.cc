#include "core/control/implicit/poisson_solver.h"

#include <algorithm>

#include "core/base/status_macros.h"
#include "core/control/implicit/poisson_operator.h"
#include "core/control/implicit/settings.h"

namespace rilievo {

absl::Status SolvePoisson(ScreenedPoisson system, const RunContext& context,
                          std::vector<float>* values) {
  PoissonOperator matrix(system, context);
  system.samples = ActiveSamples();  // makes room
  const int size = matrix.size();
  std::vector<float>& x = *values;
  std::vector<float> residual = matrix.TakeRightSide();
  // Products of the residual with itself, and with what the preconditioner makes of it.
  const auto products = [&](const auto& update) {
    return matrix.BlockSums([&](int64_t begin, int64_t end) {
      PoissonOperator::Sums sums{};
      for (int64_t i = begin; i < end; ++i) {
        update(i);
        sums[0] += double{residual[i]} * double{residual[i]};
        sums[1] += double{residual[i]} * double{residual[i] / matrix.diagonal(i)};
      }
      return sums;
    });
  };
  const double goal = kPoissonSolver.relative_residual * kPoissonSolver.relative_residual *
                      products([](int64_t) {})[0];
  std::vector<float> direction(static_cast<size_t>(size) + 1, 0.0f), image(size);
  std::copy(x.begin(), x.end(), direction.begin());
  matrix.Apply(direction, &image);
  PoissonOperator::Sums current =
      products([&](int64_t i) { residual[i] = matrix.is_free(i) ? residual[i] - image[i] : 0.0f; });
  double old_product = 0;
  for (int iteration = 0; iteration < system.iterations; ++iteration) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const auto [squared, product] = current;
    if (product <= 0 || squared <= goal) break;
    const float beta = iteration == 0 ? 0.0f : static_cast<float>(product / old_product);
    old_product = product;
    matrix.Run(size, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        direction[i] = residual[i] / matrix.diagonal(i) + beta * direction[i];
      }
    });
    const double curvature = matrix.Apply(direction, &image);
    if (curvature <= 0) break;
    const float alpha = static_cast<float>(product / curvature);
    current = products([&](int64_t i) {
      x[i] += alpha * direction[i];
      residual[i] -= alpha * image[i];
    });
  }
  return context.CheckStop();
}

}  // namespace rilievo
