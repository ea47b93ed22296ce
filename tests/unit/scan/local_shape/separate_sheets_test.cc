#include "core/scan/local_shape/separate_sheets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "core/points/morton_order.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// Spacing of points that share an area, see OrientedCloud.
double Spacing(double area, int count) { return std::sqrt(4 * area / std::numbers::pi / count); }

// The box of the points, which their curve fills.
SpatialFrame CurveOf(const Eigen::Matrix3Xd& points) {
  std::vector<int> columns(static_cast<size_t>(points.cols()));
  std::iota(columns.begin(), columns.end(), 0);
  return BoundingFrame(points, columns).value();
}

// Their columns in the order of the curve.
std::vector<int> OrderOf(const Eigen::Matrix3Xd& points) {
  const SpatialFrame curve = CurveOf(points);
  Eigen::Matrix3Xd unit = points;
  for (auto point : unit.colwise()) point = curve.UnitFromScan(point);
  return ComputeMortonOrder(unit, RunContext{}).value().order;
}

// `points`: in the order of their curve.
NeighborGraph Separate(const Eigen::Matrix3Xd& points, int threads = 2) {
  RunContext context;
  context.threads = threads;
  const PointIndex index(points);
  NeighborGraph graph = BuildNeighborGraph(index, points, NeighborOptions{}, context).value();
  EXPECT_TRUE(SeparateSheets(points, index, CurveOf(points), context, &graph).ok());
  return graph;
}

// A plate of two unit squares, its wall and its noise in spacings; points in order.
struct Plate {
  Eigen::Matrix3Xd points;
  std::vector<bool> upper;  // whether the point is of the upper square
  bool IsUpper(int point) const { return upper[point]; }
  bool IsInside(int point) const {
    return (points.col(point).head<2>().array() - 0.5).abs().maxCoeff() < 0.4;
  }
};
Plate MakePlate(int count, double wall, double noise, double bend = 0) {
  const double spacing = Spacing(2, count);
  Random random(7);
  Eigen::Matrix3Xd points(3, count);  // of the two squares by turns
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(), y = random.Uniform();
    points.col(i) << x, y,
        bend * x * x + spacing * (i % 2 == 1 ? wall : 0) + spacing * noise * random.Normal();
  }
  Plate plate;
  const std::vector<int> order = OrderOf(points);
  plate.points = points(Eigen::all, order);
  for (const int i : order) plate.upper.push_back(i % 2 == 1);
  return plate;
}

double ShareAcross(const Plate& plate, const NeighborGraph& graph) {
  int across = 0, all = 0;
  for (int i = 0; i < graph.size(); ++i) {
    if (!plate.IsInside(i)) continue;
    for (const int j : graph.neighbors(i)) across += plate.IsUpper(i) != plate.IsUpper(j);
    all += graph.k;
  }
  return static_cast<double>(across) / all;
}

void ExpectSeparated(const Plate& plate, double most_across) {
  const PointIndex index(plate.points);
  const NeighborGraph before =
      BuildNeighborGraph(index, plate.points, NeighborOptions{}, RunContext{}).value();
  const NeighborGraph after = Separate(plate.points);
  EXPECT_GT(ShareAcross(plate, before), 0.1);
  EXPECT_LT(ShareAcross(plate, after), most_across);
  int inside = 0, across = 0, last = -1;
  for (const FacingPair& pair : after.facing) {
    EXPECT_GT(pair.point, last);
    last = pair.point;
    EXPECT_EQ(after.across(pair.point), pair.across);
    inside += plate.IsInside(pair.point);
    across += plate.IsUpper(pair.point) != plate.IsUpper(pair.across);
  }
  EXPECT_GT(inside, 0.7 * 0.64 * after.size());
  EXPECT_GT(across, 0.95 * static_cast<double>(after.facing.size()));
}

TEST(SeparateSheetsTest, APlateWithoutNoise) { ExpectSeparated(MakePlate(8000, 1.2, 0), 0.03); }

TEST(SeparateSheetsTest, APlateFiveTimesAsThickAsItsNoise) {
  ExpectSeparated(MakePlate(8000, 2, 0.4), 0.06);
}

TEST(SeparateSheetsTest, ABentPlate) { ExpectSeparated(MakePlate(8000, 2, 0.3, 0.5), 0.03); }

TEST(SeparateSheetsTest, ListsStaySortedAndWithoutTheirPoint) {
  const Plate plate = MakePlate(4000, 1.5, 0.2);
  const NeighborGraph graph = Separate(plate.points);
  for (int i = 0; i < graph.size(); ++i) {
    const std::vector<float> distances = NeighborDistances(plate.points, graph, i);
    EXPECT_TRUE(std::is_sorted(distances.begin(), distances.end()));
    const auto list = graph.neighbors(i);
    EXPECT_EQ(std::count(list.begin(), list.end(), i), 0);
  }
}

TEST(SeparateSheetsTest, AnyNumberOfThreadsFindsTheSame) {
  const Plate plate = MakePlate(4000, 2, 0.4);
  const NeighborGraph one = Separate(plate.points, 1), four = Separate(plate.points, 4);
  EXPECT_EQ(one.indices, four.indices);
  ASSERT_EQ(one.facing.size(), four.facing.size());
  for (size_t i = 0; i < one.facing.size(); ++i) {
    EXPECT_EQ(one.facing[i].point, four.facing[i].point);
    EXPECT_EQ(one.facing[i].across, four.facing[i].across);
  }
}

// Next to none of the points stands in a layer: one or so in a hundred by chance.
void ExpectOneSheet(const Eigen::Matrix3Xd& points) {
  EXPECT_LT(Separate(points(Eigen::all, OrderOf(points))).facing.size(),
            0.015 * static_cast<double>(points.cols()));
}

TEST(SeparateSheetsTest, NoiseOfOneSheetIsNoSecondOne) {
  for (const double noise : {0.1, 0.4, 1.0}) {
    KnownCloud sphere = SphereCloud(8000, 3);
    AddNoise(noise * Spacing(4 * std::numbers::pi, 8000), 5, &sphere);
    ExpectOneSheet(sphere.cloud.points);
  }
}

TEST(SeparateSheetsTest, AStepIsNotTwoSheets) {
  constexpr int kCount = 8000;
  Random random(11);
  Eigen::Matrix3Xd points(3, kCount);
  for (int i = 0; i < kCount; ++i) {
    const double x = random.Uniform();
    points.col(i) << x, random.Uniform(), x > 0.5 ? 1.5 * Spacing(1, kCount) : 0;
  }
  ExpectOneSheet(points);
}

TEST(SeparateSheetsTest, ARaisedPatternIsNotTwoSheets) {
  constexpr int kCount = 8000;
  const double spacing = Spacing(1, kCount);
  Random random(13);
  Eigen::Matrix3Xd points(3, kCount);
  for (int i = 0; i < kCount; ++i) {
    const double x = random.Uniform(), y = random.Uniform();
    const bool raised = std::fmod(x, 10 * spacing) < 5 * spacing;
    points.col(i) << x, y, raised ? spacing : 0;
  }
  ExpectOneSheet(points);
}

TEST(SeparateSheetsTest, FewPointsAreLeftAlone) {
  const Plate plate = MakePlate(40, 1, 0);
  EXPECT_TRUE(Separate(plate.points).facing.empty());
}

}  // namespace
}  // namespace rilievo
