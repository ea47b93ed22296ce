// Scans with a ground and things above it: those seen from above, from below and all around.
#include "core/scan/orientation/seen_from_above.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <ostream>
#include <stop_token>
#include <vector>

#include "core/points/point_index.h"
#include "core/scan/clean/check_scan.h"
#include "core/scan/orientation/edge_sign_votes.h"
#include "core/scan/scan_surface.h"
#include "tests/unit/scan/orientation/airborne_scene.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct KnownThing {
  const char* name;
  std::function<void(AirborneScene*)> add;
  double noise = 0;
};
void PrintTo(const KnownThing& thing, std::ostream* out) { *out << thing.name; }

// Upper half of a ball's directions, and the lower one.
bool IsUpper(const Eigen::Vector3d& way) { return way.z() > 0; }
bool IsLower(const Eigen::Vector3d& way) { return way.z() < 0; }

void AddPosts(double x, double y, double height, AirborneScene* s) {
  for (const double side_x : {-x, x})
    for (const double side_y : {-y, y}) s->AddPost(kHolder, {side_x, side_y, 1}, 1.2, height - 1);
}

// Their upper sides alone, and no ground below.
std::vector<KnownThing> SeenFromAbove() {
  return {
      {"ball",
       [](auto* s) {
         s->AddGroundAround(9, 9);
         s->AddBall(kThing, {0, 0, 20}, 9, IsUpper);
       }},
      {"canopy_on_posts",
       [](auto* s) {
         s->AddGroundAround(12, 8);
         s->AddSheet(kThing, {-18, -14, 14}, {36, 0, 0}, {0, 28, 0});
         AddPosts(15, 11, 14, s);
       },
       0.3},
      {"sail",
       [](auto* s) {
         s->AddGroundAround(13, 13);
         s->AddSheet(kThing, {-16, -16, 16}, {32, 0, 0}, {0, 32, 0}, [](double x, double y) {
           return 0.03 * ((x - 16) * (x - 16) - (y - 16) * (y - 16));
         });
         s->AddPost(kHolder, {-15, 0, 0}, 0.8, 23);
         s->AddPost(kHolder, {15, 0, 0}, 0.8, 23);
         s->AddPost(kHolder, {0, -15, 0}, 0.8, 9);
         s->AddPost(kHolder, {0, 15, 0}, 0.8, 9);
       }},
      {"vault",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-15, -10, 8}, {30, 0, 0}, {0, 20, 0},
                     [](double x, double) { return 10 * std::sin(std::numbers::pi * x / 30); });
       }},
      {"bridge",
       [](auto* s) {
         s->AddGround([](double x, double) { return 10 / (1 + std::exp(-(std::abs(x) - 25))); });
         s->AddSheet(kThing, {-27, -8, 11}, {54, 0, 0}, {0, 16, 0});
       }},
      {"house",
       [](auto* s) {
         s->AddGroundAround(12, 9);
         s->AddBox(kThing, {-12, -9, 2}, {12, 9, 12}, false);
       }},
  };
}

// Their lower sides alone, and the ground below.
std::vector<KnownThing> SeenFromBelow() {
  return {
      {"balloon",
       [](auto* s) {
         s->AddGround();
         s->AddBall(kThing, {0, 0, 24}, 12, IsLower);
       }},
      {"box_girder",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-40, -6, 10}, {0, 12, 0}, {80, 0, 0});
         s->AddSheet(kThing, {-40, -6, 10}, {80, 0, 0}, {0, 0, 4});
         s->AddSheet(kThing, {40, 6, 10}, {-80, 0, 0}, {0, 0, 4});
         for (const double x : {-20., 20.}) s->AddPost(kHolder, {x, 0, 1}, 2, 9);
       }},
      {"canopy_on_posts",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-18, -14, 14}, {0, 28, 0}, {36, 0, 0});
         AddPosts(15, 11, 14, s);
       }},
      {"tank_on_a_stem",
       [](auto* s) {
         s->AddGround();
         s->AddBall(kThing, {0, 0, 22}, 9, IsLower);
         s->AddPost(kThing, {0, 0, 22}, 9, 6);
         s->AddPost(kHolder, {0, 0, 1}, 2, 12);
       }},
      {"half_pipe",
       [](auto* s) {
         s->AddGround();
         for (double x = -8; x < 8; ++x) {
           s->AddBall(kThing, {x, 0, 14}, 6,
                      [](const auto& w) { return std::abs(w.x()) < 0.09 && IsLower(w); });
         }
       }},
      {"pavilion",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-16, 16, 10}, {16, 0, 8}, {0, -32, 0});
         s->AddSheet(kThing, {0, 16, 18}, {16, 0, -8}, {0, -32, 0});
         AddPosts(13, 13, 11, s);
       }},
      {"fuel_station",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-20, -12, 12}, {0, 24, 0}, {40, 0, 0});
         s->AddSheet(kThing, {-20, -12, 12}, {40, 0, 0}, {0, 0, 2.5});
         s->AddSheet(kThing, {20, 12, 12}, {-40, 0, 0}, {0, 0, 2.5});
         s->AddSheet(kThing, {-20, 12, 12}, {0, -24, 0}, {0, 0, 2.5});
         s->AddSheet(kThing, {20, -12, 12}, {0, 24, 0}, {0, 0, 2.5});
         for (const double x : {-12., 12.}) s->AddPost(kHolder, {x, 0, 1}, 1.5, 11);
       }},
  };
}

std::vector<KnownThing> SeenAllAround() {
  return {
      {"ball_on_the_ground",
       [](auto* s) {
         s->AddGround();
         s->AddBall(kThing, {0, 0, 10.5}, 9);
       }},
      {"table",
       [](auto* s) {
         s->AddGround();
         s->AddBox(kThing, {-14, -10, 9}, {14, 10, 11});
         AddPosts(12, 8, 9, s);
       }},
      {"thin_table",
       [](auto* s) {
         s->AddGround();
         s->AddBox(kThing, {-14, -10, 9}, {14, 10, 10.4});
       },
       0.3},
      {"low_deck",
       [](auto* s) {
         s->AddGround();
         s->AddBox(kThing, {-25, -15, 3}, {25, 15, 5});
       },
       0.3},
      {"plate",
       [](auto* s) {
         s->AddGround();
         s->AddBox(kThing, {-25, -15, 12}, {25, 15, 13});
       }},
      {"storeys",
       [](auto* s) {
         s->AddGround();
         for (const double z : {6., 12., 18.}) s->AddBox(kThing, {-20, -12, z}, {20, 12, z + 2});
       }},
      {"cup",
       [](auto* s) {
         s->AddGround();
         s->AddBall(kThing, {0, 0, 24}, 12, IsLower);
         s->AddBall(kThing, {0, 0, 24}, 10, IsLower, -1);
       }},
      {"pipe",
       [](auto* s) {
         s->AddGround();
         for (double x = -40; x < 40; ++x)
           s->AddBall(kThing, {x, 0, 8}, 3, [](const auto& w) { return std::abs(w.x()) < 0.17; });
       }},
  };
}

// What the neighbours' votes do not tell rightly as a rule.
std::vector<KnownThing> Hollows() {
  return {
      {"bridge_with_underside",
       [](auto* s) {
         s->AddGround([](double x, double) { return 10 / (1 + std::exp(-(std::abs(x) - 25))); });
         s->AddSheet(kThing, {-27, -8, 11}, {54, 0, 0}, {0, 16, 0});
         s->AddSheet(kThing, {-24, -8, 8}, {0, 16, 0}, {48, 0, 0});
       }},
      {"cave",
       [](auto* s) {
         s->AddGround([](double x, double y) { return 30 * std::exp(-(x * x + y * y) / 800); });
         s->AddBall(kThing, {0, 0, 14}, 9, nullptr, -1);
       }},
      {"gallery",
       [](auto* s) {
         s->AddGround([](double x, double) { return x > 0 ? 22 : 0; });
         s->AddSheet(kThing, {0, -12, 5}, {40, 0, 0}, {0, 24, 0});
         s->AddSheet(kThing, {0, -12, 14}, {0, 24, 0}, {40, 0, 0});
       }},
      {"low_roof_over_a_stand",
       [](auto* s) {
         s->AddGround();
         s->AddSheet(kThing, {-20, -15, 2}, {40, 0, 14}, {0, 30, 0});
         s->AddSheet(kThing, {-8, -15, 8.5}, {28, 0, 10}, {0, 30, 0});
       }},
      {"tunnel",
       [](auto* s) {
         s->AddGround([](double x, double) { return std::abs(x) < 20 ? 24 : 0; });
         s->AddSheet(kThing, {-20, -45, 2}, {40, 0, 0}, {0, 90, 0});
         s->AddSheet(kThing, {-20, -8, 12}, {0, 16, 0}, {40, 0, 0});
       }},
  };
}

// Shares of the points of the ground and of the thing whose normals are the wrong way round.
struct WrongShares {
  double ground = 0, thing = 0;
};

// `normal_of`: of a point of the scene's cloud, by its number.
template <typename NormalOf>
WrongShares CompareScene(const AirborneScene& scene, const KnownCloud& known,
                         const NormalOf& normal_of) {
  std::array<int, 3> wrong{}, all{};
  for (int i = 0; i < known.cloud.points.cols(); ++i) {
    const auto thing = static_cast<size_t>(scene.thing(i));
    ++all[thing];
    wrong[thing] += normal_of(i).dot(known.normals.col(i)) < 0;
  }
  return {static_cast<double>(wrong[kGround]) / all[kGround],
          static_cast<double>(wrong[kThing]) / all[kThing]};
}

class SeenFromAboveTest : public ::testing::TestWithParam<KnownThing> {
 protected:
  SeenFromAboveTest() : scene_(GetParam().noise) {
    GetParam().add(&scene_);
    known_ = scene_.Known();
  }
  AirborneScene scene_;
  KnownCloud known_;
};

TEST_P(SeenFromAboveTest, WhatWasSeenIsInFront) {
  RunContext context;
  context.threads = 2;
  const CheckedScan checked = CheckScan(known_.cloud, CheckOptions{}, context).value();
  const ScanSurface surface = AnalyzeScan(checked, ScanOptions{}, context).value();
  Eigen::Matrix3Xd places(3, surface.cloud.points.cols());
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    places.col(i) = surface.frame.ScanFromUnit(surface.cloud.points.col(i));
  }
  const PointIndex index(places);
  const WrongShares wrong = CompareScene(scene_, known_, [&](int i) -> Eigen::Vector3d {
    int nearest = 0;
    double squared = 0;
    index.Nearest(known_.cloud.points.col(i), 1, &nearest, &squared);
    return surface.cloud.normals.col(nearest);
  });
  EXPECT_LT(wrong.ground, 0.002);
  EXPECT_LT(wrong.thing, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Above, SeenFromAboveTest, ::testing::ValuesIn(SeenFromAbove()));
INSTANTIATE_TEST_SUITE_P(Below, SeenFromAboveTest, ::testing::ValuesIn(SeenFromBelow()));
INSTANTIATE_TEST_SUITE_P(AllAround, SeenFromAboveTest, ::testing::ValuesIn(SeenAllAround()));

// TurnToSky for the true normals of a scene.
struct TrueNormals {
  explicit TrueNormals(const AirborneScene& scene)
      : known(scene.Known()), prepared(Prepare(known)) {
    const RunContext context;
    cloud = EstimateNormals(prepared.scan.points, prepared.graph, {}, context).value().cloud;
    cloud.normals = prepared.normals;
    const std::vector<float> relations = EdgeSignVotes(prepared.graph, cloud, context).value();
    patches = SurePatches(prepared.graph, relations, context).value();
    links = LinksBetween(patches, prepared.graph, relations, cloud, context).value();
  }
  absl::Status Turn(const RunContext& context) {
    return TurnToSky(patches, links, prepared.graph.k, &cloud, context);
  }

  KnownCloud known;
  PreparedCloud prepared;
  OrientedCloud cloud;
  OrientationPatches patches;
  std::vector<SignedLink> links;
};

TEST(TurnToSkyTest, HollowsThatAreRightStay) {
  for (const KnownThing& thing : Hollows()) {
    AirborneScene scene;
    thing.add(&scene);
    TrueNormals normals(scene);
    EXPECT_TRUE(normals.Turn(RunContext{}).ok());
    EXPECT_EQ(WrongShare(normals.cloud.normals, normals.prepared.normals), 0) << thing.name;
  }
}

TEST(TurnToSkyTest, IsStopped) {
  AirborneScene scene;
  scene.AddGround();
  TrueNormals normals(scene);
  std::stop_source stop;
  RunContext context;
  context.stop = stop.get_token();
  stop.request_stop();
  EXPECT_EQ(normals.Turn(context).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
