// Scenes that were seen from above, as from the air, and things above the ground in them.
#include "core/scan/orientation/seen_from_above.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "core/points/point_index.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/scan_surface.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

constexpr int kGround = 0;

// Points about 1 apart, with normals that face what is outside, or above.
class AirborneScene {
 public:
  explicit AirborneScene(double noise = 0) : noise_(noise) {}

  // A point each unit of u and v from the corner, bent along the normal by `height`.
  void AddSheet(int thing, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                const Eigen::Vector3d& v,
                const std::function<double(double, double)>& height = nullptr) {
    const Eigen::Vector3d normal = u.cross(v).normalized();
    const double width = u.norm(), depth = v.norm(), jitter = 0.3, step = 1e-3;
    const auto at = [&](double x, double y) -> Eigen::Vector3d {
      return corner + u * (x / width) + v * (y / depth) + (height ? height(x, y) : 0) * normal;
    };
    for (double x = 0.5; x < width; ++x) {
      for (double y = 0.5; y < depth; ++y) {
        const double a = x + jitter * Signed(), b = y + jitter * Signed();
        const Eigen::Vector3d du = at(a + step, b) - at(a, b), dv = at(a, b + step) - at(a, b);
        Add(thing, at(a, b), du.cross(dv).normalized());
      }
    }
  }
  // 120 units wide; `bump` above the plane z = 0.
  void AddGround(const std::function<double(double, double)>& bump = nullptr, double from_x = -60,
                 double to_x = 60) {
    AddSheet(kGround, {from_x, -60, 0}, {to_x - from_x, 0, 0}, {0, 120, 0},
             [&, from_x](double x, double y) {
               return std::sin(0.1 * x) + std::cos(0.12 * y) +
                      (bump ? bump(x + from_x, y - 60) : 0);
             });
  }
  // `keeps`: of directions from the centre. `side`: 1 outward.
  void AddBall(int thing, const Eigen::Vector3d& center, double radius,
               const std::function<bool(const Eigen::Vector3d&)>& keeps = nullptr, int side = 1) {
    const int count = static_cast<int>(4 * std::numbers::pi * radius * radius);
    for (int i = 0; i < count; ++i) {
      const double z = 1 - 2 * (i + 0.5) / count, angle = 2.399963 * i;
      const double around = std::sqrt(1 - z * z);
      const Eigen::Vector3d way(around * std::cos(angle), around * std::sin(angle), z);
      if (!keeps || keeps(way)) Add(thing, center + radius * way, side * way);
    }
  }
  // All six faces, or without the lower one.
  void AddBox(int thing, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
              bool has_bottom = true) {
    const Eigen::Vector3d size = to - from;
    const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
    AddSheet(thing, from + z, x, y);
    if (has_bottom) AddSheet(thing, from, y, x);
    AddSheet(thing, from, x, z);
    AddSheet(thing, from + y, z, x);
    AddSheet(thing, from, z, y);
    AddSheet(thing, from + x, y, z);
  }
  // Upright.
  void AddPost(int thing, const Eigen::Vector3d& foot, double radius, double height) {
    for (double z = 0.5; z < height; ++z) {
      for (double angle = 0; angle < 2 * std::numbers::pi; angle += 1 / radius) {
        const Eigen::Vector3d way(std::cos(angle), std::sin(angle), 0);
        Add(thing, foot + radius * way + Eigen::Vector3d(0, 0, z), way);
      }
    }
  }

  KnownCloud Known() const {
    const auto count = static_cast<Eigen::Index>(points_.size());
    KnownCloud known;
    known.cloud.points = Eigen::Map<const Eigen::Matrix3Xd>(points_.data()->data(), 3, count);
    known.normals = Eigen::Map<const Eigen::Matrix3Xd>(normals_.data()->data(), 3, count);
    return known;
  }
  size_t size() const { return thing_.size(); }
  int thing(int point) const { return thing_[static_cast<size_t>(point)]; }

 private:
  double Signed() { return 2 * random_.Uniform() - 1; }
  void Add(int thing, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    points_.push_back(point + noise_ * Eigen::Vector3d(Signed(), Signed(), Signed()));
    normals_.push_back(normal);
    thing_.push_back(thing);
  }

  double noise_;
  Random random_{7};
  std::vector<Eigen::Vector3d> points_, normals_;
  std::vector<int> thing_;
};

struct Thing {
  const char* name;
  // Up to which the pipeline finds all sides; below 0: its links are wrong, or no sky can tell.
  double most_noise;
  std::function<void(AirborneScene*)> add;
};

std::vector<Thing> Things() {
  return {
      {"ball", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBall(1, {0, 0, 20}, 9);
       }},
      {"ball_on_a_stick", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBall(1, {0, 0, 20}, 9);
         s->AddPost(2, {0, 0, 2}, 1.2, 9);
       }},
      {"ball_on_the_ground", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBall(1, {0, 0, 10.5}, 9);
       }},
      {"thick_table", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-14, -10, 9}, {14, 10, 13});
         for (const double x : {-12., 12.})
           for (const double y : {-8., 8.}) s->AddPost(2, {x, y, 2}, 1.2, 7);
       }},
      {"table", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-14, -10, 9}, {14, 10, 11});
         for (const double x : {-12., 12.})
           for (const double y : {-8., 8.}) s->AddPost(2, {x, y, 2}, 1.2, 7);
       }},
      {"thin_table", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-14, -10, 9}, {14, 10, 10.4});
       }},
      {"deck", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-25, -15, 4}, {25, 15, 7});
       }},
      {"low_deck", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-25, -15, 3}, {25, 15, 5});
       }},
      {"plate", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-25, -15, 12}, {25, 15, 13});
       }},
      {"bridge_with_underside", -1,
       [](auto* s) {
         s->AddGround([](double x, double) { return 10 / (1 + std::exp(-(std::abs(x) - 25))); });
         s->AddSheet(1, {-27, -8, 11}, {54, 0, 0}, {0, 16, 0});
         s->AddSheet(1, {-24, -8, 8}, {0, 16, 0}, {48, 0, 0});
       }},
      {"bridge", 0.3,
       [](auto* s) {
         s->AddGround([](double x, double) { return 10 / (1 + std::exp(-(std::abs(x) - 25))); });
         s->AddSheet(1, {-27, -8, 11}, {54, 0, 0}, {0, 16, 0});
       }},
      {"cave", -1,
       [](auto* s) {
         s->AddGround([](double x, double y) { return 30 * std::exp(-(x * x + y * y) / 800); });
         s->AddBall(1, {0, 0, 14}, 9, nullptr, -1);
       }},
      {"gallery", -1,
       [](auto* s) {
         s->AddGround([](double x, double) { return x > 0 ? 22 : 0; });
         s->AddSheet(1, {0, -12, 5}, {40, 0, 0}, {0, 24, 0});
         s->AddSheet(1, {0, -12, 14}, {0, 24, 0}, {40, 0, 0});
       }},
      {"bowl", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddSheet(1, {-10, -10, 12}, {20, 0, 0}, {0, 20, 0}, [](double x, double y) {
           return 0.08 * ((x - 10) * (x - 10) + (y - 10) * (y - 10));
         });
       }},
      {"vault", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddSheet(1, {-15, -10, 8}, {30, 0, 0}, {0, 20, 0},
                     [](double x, double) { return 10 * std::sin(std::numbers::pi * x / 30); });
       }},
      {"roof_over_a_stand", 0,
       [](auto* s) {
         s->AddGround();
         s->AddSheet(1, {-20, -15, 2}, {40, 0, 14}, {0, 30, 0});
         s->AddSheet(1, {20, -15, 16}, {0, 0, 6}, {0, 30, 0});
         s->AddSheet(1, {-8, -15, 16}, {28, 0, 6}, {0, 30, 0});
       }},
      {"low_roof_over_a_stand", -1,
       [](auto* s) {
         s->AddGround();
         s->AddSheet(1, {-20, -15, 2}, {40, 0, 14}, {0, 30, 0});
         s->AddSheet(1, {-8, -15, 8.5}, {28, 0, 10}, {0, 30, 0});
       }},
      {"storeys", 0.3,
       [](auto* s) {
         s->AddGround();
         for (const double z : {6., 12., 18.}) s->AddBox(1, {-20, -12, z}, {20, 12, z + 2});
       }},
      {"house", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBox(1, {-12, -9, 2}, {12, 9, 12}, false);
       }},
      {"cup", 0.3,
       [](auto* s) {
         s->AddGround();
         const auto low = [](const Eigen::Vector3d& way) { return way.z() < 0; };
         s->AddBall(1, {0, 0, 24}, 12, low);
         s->AddBall(1, {0, 0, 24}, 10, low, -1);
       }},
      {"low_half_of_a_ball", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBall(
             1, {0, 0, 24}, 12, [](const auto& way) { return way.z() < 0; }, -1);
       }},
      {"tunnel", -1,
       [](auto* s) {
         s->AddGround([](double x, double) { return std::abs(x) < 20 ? 24 : 0; });
         s->AddSheet(1, {-20, -60, 2}, {40, 0, 0}, {0, 120, 0},
                     [](double x, double) { return 0 * x; });
         s->AddSheet(1, {-20, -8, 12}, {0, 16, 0}, {40, 0, 0});
       }},
      {"sparse_table", 0.3,
       [](auto* s) {
         s->AddGround();
         s->AddBall(1, {0, 0, 10}, 4);
         s->AddBox(1, {-14, 10, 5}, {14, 30, 7});
       }},
      {"pipe", 0.3,
       [](auto* s) {
         s->AddGround();
         for (double x = -40; x < 40; ++x)
           s->AddBall(1, {x, 0, 8}, 3, [](const auto& w) { return std::abs(w.x()) < 0.17; });
       }},
  };
}

// Shares of the points of the ground and of things 1 whose normals are the wrong way round.
struct WrongShares {
  double ground = 0, thing = 0;
};

// `normal_of`: of a point of the scene's cloud, by its number, and whether it has one.
template <typename NormalOf>
WrongShares CompareScene(const AirborneScene& scene, const KnownCloud& known,
                         const NormalOf& normal_of) {
  std::array<int, 2> wrong{}, all{};
  for (int i = 0; i < known.cloud.points.cols(); ++i) {
    const auto thing = static_cast<size_t>(scene.thing(i));
    if (thing > 1) continue;
    ++all[thing];
    wrong[thing] += normal_of(i).dot(known.normals.col(i)) < 0;
  }
  return {static_cast<double>(wrong[0]) / all[0], static_cast<double>(wrong[1]) / all[1]};
}

WrongShares AnalyzeScene(const AirborneScene& scene) {
  RunContext context;
  context.threads = 2;
  const KnownCloud known = scene.Known();
  const CheckedScan checked = CheckScan(known.cloud, CheckOptions{}, context).value();
  const ScanSurface surface = AnalyzeScan(checked, ScanOptions{}, context).value();
  Eigen::Matrix3Xd places(3, surface.cloud.points.cols());
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    places.col(i) = surface.frame.ScanFromUnit(surface.cloud.points.col(i));
  }
  const PointIndex index(places);
  return CompareScene(scene, known, [&](int i) -> Eigen::Vector3d {
    int nearest = 0;
    double squared = 0;
    index.Nearest(known.cloud.points.col(i), 1, &nearest, &squared);
    return surface.cloud.normals.col(nearest);
  });
}

// What becomes of true normals, but for those of `inverted` things.
WrongShares TurnTrueNormals(const AirborneScene& scene, bool inverted) {
  const RunContext context;
  const KnownCloud known = scene.Known();
  const PreparedCloud prepared = Prepare(known);
  OrientedCloud cloud =
      EstimateNormals(prepared.scan.points, prepared.graph, {}, context).value().cloud;
  cloud.normals = prepared.normals;
  for (int i = 0; i < cloud.normals.cols(); ++i) {
    if (inverted && scene.thing(prepared.scan.source_index[i]) == 1) cloud.normals.col(i) *= -1;
  }
  const std::vector<float> relations = EdgeSignVotes(prepared.graph, cloud, context).value();
  const OrientationPatches patches = SurePatches(prepared.graph, relations, context).value();
  const std::vector<SignedLink> links =
      LinksBetween(patches, prepared.graph, relations, cloud, context).value();
  EXPECT_TRUE(TurnToSky(patches, links, prepared.graph.k, &cloud, context).ok());
  std::vector<int> place(scene.size(), -1);
  for (int i = 0; i < cloud.normals.cols(); ++i) place[prepared.scan.source_index[i]] = i;
  return CompareScene(scene, known, [&](int i) -> Eigen::Vector3d {
    if (place[i] < 0) return known.normals.col(i);
    return cloud.normals.col(place[i]);
  });
}

class SeenFromAboveTest : public ::testing::TestWithParam<std::tuple<int, double>> {
 protected:
  Thing thing() const { return Things()[static_cast<size_t>(std::get<0>(GetParam()))]; }
  AirborneScene Scene() const {
    AirborneScene scene(std::get<1>(GetParam()));
    thing().add(&scene);
    return scene;
  }
};

TEST_P(SeenFromAboveTest, ThingsAboveTheGroundFaceOutwardOrUp) {
  if (std::get<1>(GetParam()) > thing().most_noise) GTEST_SKIP() << thing().name;
  const WrongShares wrong = AnalyzeScene(Scene());
  EXPECT_LT(wrong.ground, 0.002) << thing().name;
  EXPECT_LT(wrong.thing, 0.03) << thing().name;
}

// Floors and ceilings of caves, galleries and storeys among it.
TEST_P(SeenFromAboveTest, WhatIsRightStays) {
  if (std::get<1>(GetParam()) > 0)
    GTEST_SKIP() << "neighbours across a plate are told apart before";
  const WrongShares wrong = TurnTrueNormals(Scene(), false);
  EXPECT_EQ(wrong.ground, 0) << thing().name;
  EXPECT_EQ(wrong.thing, 0) << thing().name;
}

// A bowl's convex side is below.
TEST(TurnToSkyTest, WhatIsOpenToTheSkyIsTurned) {
  int turned = 0;
  for (const Thing& thing : Things()) {
    const std::string name = thing.name;
    if (name != "bowl" && name != "vault" && name != "ball" && name != "deck") continue;
    AirborneScene scene;
    thing.add(&scene);
    const WrongShares wrong = TurnTrueNormals(scene, true);
    EXPECT_EQ(wrong.ground, 0) << name;
    EXPECT_EQ(wrong.thing, 0) << name;
    ++turned;
  }
  EXPECT_EQ(turned, 4);
}

INSTANTIATE_TEST_SUITE_P(Scenes, SeenFromAboveTest,
                         ::testing::Combine(::testing::Range(0, static_cast<int>(Things().size())),
                                            ::testing::Values(0.0, 0.3)));

}  // namespace
}  // namespace rilievo
