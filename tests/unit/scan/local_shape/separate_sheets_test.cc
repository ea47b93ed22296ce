#include "core/scan/local_shape/separate_sheets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// Spacing of points that share an area, see OrientedCloud.
double Spacing(double area, int count) { return std::sqrt(4 * area / std::numbers::pi / count); }

struct Separated {
  NeighborGraph graph;
  std::vector<int> in_sheets;  // points whose lists have been replaced
};

Separated Separate(const Eigen::Matrix3Xd& points, int threads = 2) {
  RunContext context;
  context.threads = threads;
  const PointIndex index(points);
  NeighborGraph graph = BuildNeighborGraph(index, points, NeighborOptions{}, context).value();
  ReplacedLists replaced = SeparateSheets(points, index, context, &graph).value();
  return {std::move(graph), std::move(replaced.points)};
}

// A plate of two unit squares, its wall and its noise in spacings; points come by turns.
struct Plate {
  Eigen::Matrix3Xd points;
  static bool IsUpper(int point) { return point % 2 == 1; }
  bool IsInside(int point) const {
    return (points.col(point).head<2>().array() - 0.5).abs().maxCoeff() < 0.4;
  }
};
Plate MakePlate(int count, double wall, double noise, double bend = 0) {
  const double spacing = Spacing(2, count);
  Random random(7);
  Plate plate{Eigen::Matrix3Xd(3, count)};
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(), y = random.Uniform();
    plate.points.col(i) << x, y,
        bend * x * x + spacing * (Plate::IsUpper(i) ? wall : 0) + spacing * noise * random.Normal();
  }
  return plate;
}

double ShareAcross(const Plate& plate, const NeighborGraph& graph) {
  int across = 0, all = 0;
  for (int i = 0; i < graph.size(); ++i) {
    if (!plate.IsInside(i)) continue;
    for (const int j : graph.neighbors(i)) across += Plate::IsUpper(i) != Plate::IsUpper(j);
    all += graph.k;
  }
  return static_cast<double>(across) / all;
}

void ExpectSeparated(const Plate& plate, double most_across) {
  const PointIndex index(plate.points);
  const NeighborGraph before =
      BuildNeighborGraph(index, plate.points, NeighborOptions{}, RunContext{}).value();
  const Separated after = Separate(plate.points);
  EXPECT_GT(ShareAcross(plate, before), 0.1);
  EXPECT_LT(ShareAcross(plate, after.graph), most_across);
  int inside = 0;
  for (const int point : after.in_sheets) inside += plate.IsInside(point);
  EXPECT_GT(inside, 0.7 * 0.64 * after.graph.size());
}

TEST(SeparateSheetsTest, APlateWithoutNoise) { ExpectSeparated(MakePlate(8000, 1.2, 0), 0.03); }

TEST(SeparateSheetsTest, APlateFiveTimesAsThickAsItsNoise) {
  ExpectSeparated(MakePlate(8000, 2, 0.4), 0.06);
}

TEST(SeparateSheetsTest, ABentPlate) { ExpectSeparated(MakePlate(8000, 2, 0.3, 0.5), 0.03); }

TEST(SeparateSheetsTest, ListsStaySortedAndWithoutTheirPoint) {
  const Plate plate = MakePlate(4000, 1.5, 0.2);
  const NeighborGraph graph = Separate(plate.points).graph;
  for (int i = 0; i < graph.size(); ++i) {
    const std::vector<float> distances = NeighborDistances(plate.points, graph, i);
    EXPECT_TRUE(std::is_sorted(distances.begin(), distances.end()));
    const auto list = graph.neighbors(i);
    EXPECT_EQ(std::count(list.begin(), list.end(), i), 0);
  }
}

TEST(SeparateSheetsTest, AnyNumberOfThreadsFindsTheSame) {
  const Plate plate = MakePlate(4000, 2, 0.4);
  const Separated one = Separate(plate.points, 1), four = Separate(plate.points, 4);
  EXPECT_EQ(one.graph.indices, four.graph.indices);
  EXPECT_EQ(one.in_sheets, four.in_sheets);
}

// Next to none of the points stands in a layer: one or so in a hundred by chance.
void ExpectOneSheet(const Eigen::Matrix3Xd& points) {
  EXPECT_LT(Separate(points).in_sheets.size(), 0.015 * static_cast<double>(points.cols()));
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
  EXPECT_TRUE(Separate(plate.points).in_sheets.empty());
}

}  // namespace
}  // namespace rilievo
