#include "tests/scans/scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tests/scans/random.h"
#include "tests/scans/scene_builder.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

// Rows of windows 1.2 wide and 1.5 tall, as many as fit.
std::vector<Window> WindowsOf(double length, double height) {
  std::vector<Window> windows;
  const int columns = static_cast<int>(length / 2.5), rows = static_cast<int>(height / 3);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double middle = length * (column + 0.5) / columns, bottom = 0.9 + 3 * row;
      windows.push_back({middle - 0.6, middle + 0.6, bottom, bottom + 1.5});
    }
  }
  return windows;
}

// The four walls of a house over [low, high], with windows all round.
void AddWalls(const Vector3d& low, const Vector2d& high, double height, SceneBuilder* builder) {
  const double width = high.x() - low.x(), depth = high.y() - low.y();
  const Vector3d x = width * Vector3d::UnitX(), y = depth * Vector3d::UnitY();
  builder->AddFacade(low, x, height, WindowsOf(width, height), 0.2);
  builder->AddFacade(low + x, y, height, WindowsOf(depth, height), 0.2);
  builder->AddFacade(low + x + y, -x, height, WindowsOf(width, height), 0.2);
  builder->AddFacade(low + y, -y, height, WindowsOf(depth, height), 0.2);
}

// A roof over the walls, its ridge along x.
void AddRoof(const Vector3d& eaves, const Vector2d& size, double rise, SceneBuilder* builder) {
  const Vector3d x = size.x() * Vector3d::UnitX(), y = size.y() * Vector3d::UnitY();
  const Vector3d to_ridge = y / 2 + rise * Vector3d::UnitZ();
  const Vector3d from_back = -y / 2 + rise * Vector3d::UnitZ();
  builder->AddFace(eaves, x, to_ridge);
  builder->AddFace(eaves + x + y, -x, from_back);
  builder->AddTriangle(eaves + x, eaves + x + y, eaves + x + to_ridge);
  builder->AddTriangle(eaves + y, eaves, eaves + to_ridge);
}

// A body and a cabin.
void AddCar(const Vector3d& middle, SceneBuilder* builder) {
  builder->AddBox(middle + Vector3d(-2.1, -0.85, 0.25), middle + Vector3d(2.1, 0.85, 0.85));
  builder->AddBox(middle + Vector3d(-1.2, -0.75, 0.85), middle + Vector3d(1.0, 0.75, 1.45));
}

void AddTable(const Vector3d& middle, SceneBuilder* builder) {
  builder->AddBox(middle + Vector3d(-0.7, -0.4, 0.71), middle + Vector3d(0.7, 0.4, 0.75));
  for (const double x : {-0.65, 0.59}) {
    for (const double y : {-0.36, 0.3}) {
      builder->AddBox(middle + Vector3d(x, y, 0), middle + Vector3d(x + 0.06, y + 0.06, 0.71));
    }
  }
}

}  // namespace

Eigen::AlignedBox3d Scene::bounds() const {
  return {Vector3d(truth.vertices.rowwise().minCoeff()),
          Vector3d(truth.vertices.rowwise().maxCoeff())};
}

Scene MakeStreet() {
  constexpr double kLength = 40, kRoad = 7, kPavement = 2, kKerb = 0.12, kGap = 2;
  SceneBuilder builder(0.2);
  const Vector3d x = kLength * Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  const Vector3d origin(-kLength / 2, 0, 0);
  builder.AddFace(origin - kRoad / 2 * y, x, kRoad * y);
  builder.AddFace(origin + kRoad / 2 * y + kKerb * z, x, kPavement * y);
  builder.AddFace(origin - (kRoad / 2 + kPavement) * y + kKerb * z, x, kPavement * y);
  builder.AddFace(origin + kRoad / 2 * y, x, kKerb * z);
  builder.AddFace(origin + x - kRoad / 2 * y, -x, kKerb * z);
  const double front = kRoad / 2 + kPavement;
  Random random(1);
  for (const double side : {-1.0, 1.0}) {
    for (double left = -kLength / 2; left < kLength / 2 - 6;) {
      const double width = std::min(random.Uniform(7, 11), kLength / 2 - left);
      const double height = random.Uniform(5, 9);
      const double near = side > 0 ? front : -front - 6;
      AddWalls({left, near, kKerb}, {left + width, near + 6}, height, &builder);
      AddRoof({left, near, kKerb + height}, {width, 6}, 2.5, &builder);
      left += width + kGap;
    }
    for (double at = -15; at < 18; at += random.Uniform(6, 11)) {
      AddCar({at, side * 2.4, 0}, &builder);
    }
    for (double at = -18; at < 20; at += 12) {
      builder.AddPost({at, side * (kRoad / 2 + 0.4), kKerb}, 0.09, 5, 8);
    }
  }
  Scene scene{"street", builder.Take(), {}, {}};
  for (const double at : {-12.0, 1.0, 13.0}) {
    scene.stations.push_back({{at, 0.3, 1.8}, -60 * kDegree, 70 * kDegree});
  }
  return scene;
}

Scene MakeBlock() {
  constexpr double kHalf = 45;
  SceneBuilder builder(0.5);
  const auto ground = [](double x, double y) {
    return 1.5 * std::sin(x / 14) * std::cos(y / 19) + 0.02 * x;
  };
  builder.AddGround({-kHalf, -kHalf}, {kHalf, kHalf}, ground);
  Random random(2);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      const Vector2d middle(22.0 * (column - 1.5), 27.0 * (row - 1));
      const Vector2d size(random.Uniform(9, 14), random.Uniform(8, 11));
      const double height = random.Uniform(4, 9);
      const Vector2d low = middle - size / 2;
      const double foot = ground(middle.x(), middle.y()) - 2;
      AddWalls({low.x(), low.y(), foot}, low + size, height + 2, &builder);
      AddRoof({low.x(), low.y(), foot + height + 2}, size, random.Uniform(2, 4), &builder);
    }
    for (int car = 0; car < 4; ++car) {
      const Vector2d at(random.Uniform(-40, 40), 27.0 * (row - 1) + 12);
      AddCar({at.x(), at.y(), ground(at.x(), at.y())}, &builder);
    }
  }
  return {"block", builder.Take(), {}, {.strips = 4, .height = 150, .half_angle = 20 * kDegree}};
}

Scene MakeGarden() {
  Scene scene = MakeBlock();
  scene.name = "garden";
  Random random(3);
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      const double radius = random.Uniform(5, 7);
      const Vector3d foot(28 * (column - 1) + random.Uniform(-5, 5), 27 * (row - 0.5), 0);
      scene.crowns.push_back({foot + random.Uniform(8, 12) * Vector3d::UnitZ(), radius, radius});
    }
  }
  return scene;
}

Scene MakeRooms() {
  constexpr double kWidth = 5, kDepth = 4, kHeight = 2.6, kWall = 0.12;
  SceneBuilder builder(0.06);
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY();
  const std::vector<Window> window = {{1.8, 3.2, 0.9, 2.2}};
  // The same door from both sides of the wall.
  const std::vector<Window> door = {{1.4, 2.3, 0, 2.05}}, door_back = {{1.7, 2.6, 0, 2.05}};
  for (const double left : {-kWidth - kWall / 2, kWall / 2}) {
    const Vector3d low(left, -kDepth / 2, 0);
    builder.AddFace(low, kWidth * x, kDepth * y);
    builder.AddFace(low + kHeight * Vector3d::UnitZ(), kDepth * y, kWidth * x);
    const bool first = left < 0;
    builder.AddFacade(low + kWidth * x, -kWidth * x, kHeight, window, 0.25);
    builder.AddFacade(low + kDepth * y, kWidth * x, kHeight, {}, 0);
    builder.AddFacade(low + kWidth * x + kDepth * y, -kDepth * y, kHeight,
                      first ? door_back : std::vector<Window>(), 0);
    builder.AddFacade(low, kDepth * y, kHeight, first ? std::vector<Window>() : door, 0);
  }
  const double foot = -kDepth / 2 + 1.4, back = -kDepth / 2 + 2.3;
  builder.AddFace({-kWall / 2, foot, 0}, 2.05 * Vector3d::UnitZ(), kWall * x);
  builder.AddFace({-kWall / 2, back, 0}, kWall * x, 2.05 * Vector3d::UnitZ());
  builder.AddFace({-kWall / 2, foot, 2.05}, 0.9 * y, kWall * x);
  builder.AddFace({-kWall / 2, foot, 0}, kWall * x, 0.9 * y);
  AddTable({-3.4, 1.0, 0}, &builder);
  AddTable({2.8, -0.6, 0}, &builder);
  builder.AddBox({-kWidth, -1.9, 0.01}, {-kWidth + 0.5, -0.9, 1.9});
  builder.AddBox({kWidth - 0.6, 1.0, 0.01}, {kWidth, 1.9, 0.9});
  builder.AddPost({1.0, 1.2, 0}, 0.2, kHeight, 24);
  Scene scene{"rooms", builder.Take(), {}, {}};
  for (const Vector2d& at : {Vector2d(-1.6, -0.9), Vector2d(-4.0, 0.2), Vector2d(3.9, 0.9)}) {
    scene.stations.push_back({{at.x(), at.y(), 1.5}, -70 * kDegree, 85 * kDegree});
  }
  return scene;
}

}  // namespace rilievo
