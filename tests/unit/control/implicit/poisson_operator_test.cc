#include "core/control/implicit/poisson_operator.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/scans/random.h"
#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

struct TorusProblem {
  OrientedShape shape = OrientShape(*MakeTorus(), 5000, kTorusArea);
  ActiveSamples samples{.points = {}, .spacing = shape.cloud.spacing};
  SparseGrid grid;
  std::vector<int8_t> sides = std::vector<int8_t>(shape.cloud.points.cols(), 1);

  TorusProblem() {
    samples.points.resize(sides.size());
    std::iota(samples.points.begin(), samples.points.end(), 0);
    grid.AddBox(Eigen::Vector3i::Constant(-35), Eigen::Vector3i::Constant(35));
    grid.Seal();
  }
  ScreenedPoisson system() const {
    return {.cloud = shape.cloud,
            .sides = sides,
            .samples = samples,
            .grid = grid,
            .origin = Eigen::Vector3d::Zero(),
            .cell = 0.02,
            .screening = 2,
            .border_free = true,
            .iterations = 12};
  }
};

// One value a node, and the 0 behind them.
std::vector<float> RandomValues(int size, uint64_t seed) {
  Random random(seed);
  std::vector<float> values(static_cast<size_t>(size) + 1, 0.0f);
  for (int i = 0; i < size; ++i) values[i] = static_cast<float>(random.Uniform(-1, 1));
  return values;
}

TEST(PoissonOperatorTest, IsSymmetricAndPositive) {
  const TorusProblem problem;
  const ScreenedPoisson system = problem.system();
  const RunContext context;
  PoissonOperator matrix(system, context);
  const std::vector<float> a = RandomValues(matrix.size(), 1), b = RandomValues(matrix.size(), 2);
  std::vector<float> of_a(a.size()), of_b(b.size());
  EXPECT_GT(matrix.Apply(a, &of_a), 0);
  EXPECT_GT(matrix.Apply(b, &of_b), 0);
  const double b_of_a = std::inner_product(b.begin(), b.end(), of_a.begin(), 0.0);
  const double a_of_b = std::inner_product(a.begin(), a.end(), of_b.begin(), 0.0);
  const double size = std::inner_product(a.begin(), a.end(), of_a.begin(), 0.0);
  EXPECT_NEAR(b_of_a, a_of_b, 1e-6 * size);
}

}  // namespace
}  // namespace rilievo
