#include "core/control/implicit/splat_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

constexpr double kCell = 0.05;  // unit frame

// ActiveSamples around the middle of a grid of 25^3 nodes, and the system they belong to.
struct Spread {
  OrientedCloud cloud;
  std::vector<int8_t> sides;
  ActiveSamples samples;
  SparseGrid grid;

  // `spacing`: in cells.
  void AddSpeaker(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, int8_t side,
                  double spacing) {
    const auto i = static_cast<Eigen::Index>(samples.points.size());
    cloud.points.conservativeResize(3, i + 1);
    cloud.normals.conservativeResize(3, i + 1);
    cloud.points.col(i) = kCell * at;
    cloud.normals.col(i) = normal.normalized();
    sides.push_back(side);
    samples.points.push_back(static_cast<int>(i));
    samples.spacing.push_back(static_cast<float>(kCell * spacing));
  }

  void Seal() {
    grid.AddBox(Eigen::Vector3i::Constant(-12), Eigen::Vector3i::Constant(12));
    grid.Seal();
  }

  ScreenedPoisson System() const {
    return {.cloud = cloud,
            .sides = sides,
            .samples = samples,
            .grid = grid,
            .origin = Eigen::Vector3d::Zero(),
            .cell = kCell,
            .screening = 2,
            .border_free = true,
            .iterations = 1};
  }

  // What all samples spread of one part, taken `at_a_time`.
  std::vector<float> Field(int part, size_t at_a_time, int threads) const {
    RunContext context;
    context.threads = threads;
    const ScreenedPoisson system = System();
    SampleSplats discs(system);
    std::vector<float> field(static_cast<size_t>(grid.size()), 0.0f);
    for (size_t begin = 0; begin < samples.points.size(); begin += at_a_time) {
      const size_t count = std::min(at_a_time, samples.points.size() - begin);
      EXPECT_TRUE(discs.Take(begin, count, context).ok());
      discs.Add(part, &field);
    }
    return field;
  }
};

double Sum(const std::vector<float>& field) {
  double sum = 0;
  for (const float value : field) sum += value;
  return sum;
}

double AreaInCells(double spacing) { return std::numbers::pi / 4 * spacing * spacing; }

// Of one sample: its area on the nodes, the components of its normal on the edges, whose middles
// they are spread around; nothing farther off its plane than the cell that it runs through.
TEST(SampleSplatsTest, ASpeakerSpreadsItsAreaAndItsNormalAroundItself) {
  const Eigen::Vector3d at(0.3, -1.6, 2.2);
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 0.5).normalized();
  for (const double spacing : {0.5, 3.0, 7.0}) {
    for (const int8_t side : {int8_t{1}, int8_t{-1}, int8_t{0}}) {
      Spread spread;
      spread.AddSpeaker(at, normal, side, spacing);
      spread.Seal();
      const std::vector<Eigen::Vector3i> nodes = spread.grid.Nodes();
      for (int part = 0; part < 4; ++part) {
        const std::vector<float> field = spread.Field(part, 1, 1);
        const double amount = AreaInCells(spacing) * (part < 3 ? side * normal[part] : 1.0);
        EXPECT_NEAR(Sum(field), amount, 1e-5 * AreaInCells(spacing)) << spacing << " " << part;
        Eigen::Vector3d moment = Eigen::Vector3d::Zero();
        for (size_t n = 0; n < field.size(); ++n) {
          if (field[n] == 0) continue;
          Eigen::Vector3d place = nodes[n].cast<double>();
          if (part < 3) place[part] += 0.5;
          moment += field[n] * (place - at);
          EXPECT_LE(std::abs(normal.dot(place - at)), normal.lpNorm<1>()) << spacing << " " << part;
        }
        EXPECT_LT(moment.norm(), 1e-5 * AreaInCells(spacing)) << spacing << " " << part;
      }
    }
  }
}

// However many are taken at a time; 600 are more than two groups.
TEST(SampleSplatsTest, SpeakersAddUp) {
  Spread spread;
  Eigen::Vector4d whole = Eigen::Vector4d::Zero();
  for (int i = 0; i < 600; ++i) {
    const Eigen::Vector3d normal(std::sin(i), std::cos(i), 0.3);
    const double spacing = 0.5 + i % 5;
    spread.AddSpeaker(8 * Eigen::Vector3d(std::sin(3.0 * i), std::sin(7.0 * i), std::sin(11.0 * i)),
                      normal, i % 3 == 0 ? -1 : 1, spacing);
    const Eigen::Vector3d flux = (i % 3 == 0 ? -1 : 1) * normal.normalized();
    whole.head<3>() += AreaInCells(spacing) * flux;
    whole[3] += AreaInCells(spacing);
  }
  spread.Seal();
  for (int part = 0; part < 4; ++part) {
    const std::vector<float> field = spread.Field(part, 600, 1);
    EXPECT_NEAR(Sum(field), whole[part], 1e-4 * whole[3]) << part;
    EXPECT_EQ(spread.Field(part, 100, 1), field) << part;
  }
}

TEST(SampleSplatsTest, TheNumberOfThreadsDoesNotChangeABit) {
  OrientedShape shape = OrientShape(*MakeTorus(), 5000, kTorusArea);
  Spread spread;
  spread.sides.assign(shape.cloud.spacing.size(), 1);
  spread.samples.spacing = shape.cloud.spacing;
  for (int i = 0; i < shape.cloud.points.cols(); ++i) spread.samples.points.push_back(i);
  spread.cloud = std::move(shape.cloud);
  spread.Seal();
  for (int part = 0; part < 4; ++part) {
    const std::vector<float> field = spread.Field(part, 5000, 1);
    EXPECT_GT(*std::max_element(field.begin(), field.end()), 0);
    for (const int threads : {2, 4}) EXPECT_EQ(spread.Field(part, 5000, threads), field) << part;
  }
}

TEST(SampleSplatsTest, StopsWhenAsked) {
  Spread spread;
  spread.AddSpeaker({0, 0, 0}, {0, 0, 1}, 1, 1);
  spread.Seal();
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  const ScreenedPoisson system = spread.System();
  SampleSplats discs(system);
  EXPECT_EQ(discs.Take(0, 1, context).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
