#include "core/booleans/combine_solids.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr SolidOperation kOperations[] = {SolidOperation::kUnion, SolidOperation::kIntersection,
                                          SolidOperation::kDifference};

// Components and genus; nothing where nothing is left.
using Shape = std::optional<std::pair<int64_t, int64_t>>;

struct Result {
  Shape shape;
  double volume = 0;
};

// A closed oriented manifold, or the one error that says that nothing is left.
Result Combined(const TriangleMesh& a, const TriangleMesh& b, SolidOperation operation) {
  const auto made = CombineSolids(a, b, operation, RunContext());
  if (!made.ok()) {
    EXPECT_EQ(made.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(made.status().message()), HasSubstr("nothing is left"));
    return {};
  }
  const TriangleMesh& mesh = made->mesh;
  const auto count = static_cast<int>(mesh.vertices.cols());
  const auto topology = BuildMeshTopology(mesh.triangles, count);
  EXPECT_TRUE(topology.ok()) << topology.status();
  const TopologySummary summary = SummarizeTopology(mesh.triangles, count);
  EXPECT_TRUE(summary.closed() && summary.manifold() && summary.oriented);
  return {std::pair(summary.components, summary.genus), VolumeOf(mesh)};
}

// The three results, with V(A) + V(B) = V(union) + V(intersection), V(A - B) = V(A) -
// V(intersection).
std::vector<Result> AllThree(const TriangleMesh& a, const TriangleMesh& b) {
  std::vector<Result> results;
  for (const SolidOperation operation : kOperations) results.push_back(Combined(a, b, operation));
  const double of_a = VolumeOf(a), both = of_a + VolumeOf(b);
  EXPECT_NEAR(results[0].volume + results[1].volume, both, 1e-9 * both);
  EXPECT_NEAR(results[2].volume, of_a - results[1].volume, 1e-9 * both);
  return results;
}

struct Case {
  const char* name;
  TriangleMesh a, b;
  Shape united, common, rest;
};

const Shape kNothing;

Shape Is(int64_t components, int64_t genus) { return std::pair(components, genus); }

std::vector<Case> KnownCases() {
  const TriangleMesh box = UnitBox(0, 0, 0), torus = TorusMesh(1, 0.3, 40, 20);
  const Eigen::Affine3d upright(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  const TriangleMesh tip = MeshOf({{.4, .4, 1}, {.3, .3, 2}, {.6, .3, 2}, {.4, .7, 2}},
                                  {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}});
  const TriangleMesh inner = MeshOf({{.4, .4, 1}, {.3, .3, .5}, {.6, .3, .5}, {.4, .7, .5}},
                                    {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}});
  return {
      {"spheres", SphereMesh(4), Moved(SphereMesh(4), By(.7, .1, .2)), Is(1, 0), Is(1, 0),
       Is(1, 0)},
      {"far apart", box, UnitBox(3, 0, 0), Is(2, 0), kNothing, Is(1, 0)},
      {"one inside the other", box, BoxMesh({.2, .2, .2}, {.8, .8, .8}), Is(1, 0), Is(1, 0),
       Is(2, 0)},
      {"corners overlap", box, UnitBox(.5, .5, .5), Is(1, 0), Is(1, 0), Is(1, 0)},
      {"a bar through a box", box, BoxMesh({.3, .3, -1}, {.6, .6, 2}), Is(1, 0), Is(1, 0),
       Is(1, 1)},
      {"a ball that leaves a frame", BoxMesh({-.8, -.8, -.8}, {.8, .8, .8}), SphereMesh(4),
       Is(1, 0), Is(1, 0), Is(1, 5)},
      {"linked rings", torus, Moved(torus, By(1, 0, 0) * upright), Is(2, 2), kNothing, Is(1, 1)},
      {"crossed rings", torus, Moved(torus, upright), Is(1, 3), Is(2, 0), Is(2, 0)},
      {"the same box", box, box, Is(1, 0), Is(1, 0), kNothing},
      {"the same ring", torus, torus, Is(1, 1), Is(1, 1), kNothing},
      {"a face in common", box, UnitBox(0, 0, 1), Is(1, 0), kNothing, Is(1, 0)},
      {"a part of a face in common", box, BoxMesh({1, .2, .3}, {2, .7, 1.4}), Is(1, 0), kNothing,
       Is(1, 0)},
      {"the end of a bar on the side of a thin plate", BoxMesh({0, 0, 0}, {1, .25, .0015}),
       BoxMesh({0, -.6, -3}, {.25, 0, .0015}), Is(1, 0), kNothing, Is(1, 0)},
      {"an edge in common", box, UnitBox(1, 1, 0), Is(2, 0), kNothing, Is(1, 0)},
      {"a part of an edge in common", box, UnitBox(1, 1, .5), Is(2, 0), kNothing, Is(1, 0)},
      {"a corner in common", box, UnitBox(1, 1, 1), Is(2, 0), kNothing, Is(1, 0)},
      {"a corner on a face", box, tip, Is(2, 0), kNothing, Is(1, 0)},
      {"a corner cut out flush", box, BoxMesh({.5, .5, .5}, {1, 1, 1}), Is(1, 0), Is(1, 0),
       Is(1, 0)},
      {"a bore from face to face", box, BoxMesh({.3, .3, 0}, {.7, .7, 1}), Is(1, 0), Is(1, 0),
       Is(1, 1)},
      {"a corner that touches from inside", box, inner, Is(1, 0), Is(1, 0), Is(2, 0)},
      {"four faces in one plane", box, UnitBox(.5, 0, 0), Is(1, 0), Is(1, 0), Is(1, 0)},
  };
}

TEST(CombineSolidsTest, KnownShapes) {
  for (const Case& known : KnownCases()) {
    for (const bool askew : {false, true}) {
      SCOPED_TRACE(std::string(known.name) + (askew ? ", turned" : ""));
      const Eigen::Affine3d pose = askew ? Askew() : Eigen::Affine3d::Identity();
      const std::vector<Result> results = AllThree(Moved(known.a, pose), Moved(known.b, pose));
      EXPECT_EQ(results[0].shape, known.united);
      EXPECT_EQ(results[1].shape, known.common);
      EXPECT_EQ(results[2].shape, known.rest);
    }
  }
}

TEST(CombineSolidsTest, SpheresHaveTheVolumeOfTheLens) {
  const double d = 0.8, lens = std::numbers::pi / 12 * (4 + d) * (2 - d) * (2 - d);
  const TriangleMesh sphere = SphereMesh(6);
  const Result common = Combined(sphere, Moved(sphere, By(d, 0, 0)), kOperations[1]);
  EXPECT_NEAR(common.volume, lens, 1e-3 * lens);
}

TEST(CombineSolidsTest, RandomPosesKeepTheVolumes) {
  std::mt19937_64 random(7);
  const TriangleMesh shapes[] = {SphereMesh(1), TorusMesh(1, .4, 10, 7), UnitBox(-.5, -.5, -.5),
                                 RandomTetrahedron(2, random)};
  for (int i = 0; i < 96; ++i) {
    SCOPED_TRACE(i);
    AllThree(Moved(shapes[i % 4], RandomPose(1, random)),
             Moved(shapes[i / 4 % 4], RandomPose(1, random)));
  }
}

// A solid and what is the same but for moves far smaller than its triangles: the faces of one cross
// those of the other everywhere, at flat angles.
TEST(CombineSolidsTest, SolidsThatNearlyCoincide) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  const TriangleMesh ring = Moved(TorusMesh(1, .4, 40, 20), Askew());
  for (const double most : {1e-7, 0.0}) {
    SCOPED_TRACE(most);
    TriangleMesh copy = ring;
    for (double& x : copy.vertices.reshaped()) {
      x = most > 0 ? x + most * part(random) : static_cast<float>(x);
    }
    const std::vector<Result> results = AllThree(ring, copy);
    EXPECT_EQ(results[0].shape, Is(1, 1));
    EXPECT_EQ(results[1].shape, Is(1, 1));
    EXPECT_GT(results[2].volume, 0);
  }
}

// On small grids most pairs touch in corners, edges or planes.
TEST(CombineSolidsTest, TetrahedraOnAGridKeepTheVolumes) {
  std::mt19937_64 random(11);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    const TriangleMesh a = RandomTetrahedron(2 + i % 4, random),
                       b = RandomTetrahedron(2 + i % 4, random);
    const Eigen::Affine3d pose = i % 2 == 0 ? Eigen::Affine3d::Identity() : Askew();
    AllThree(Moved(a, pose), Moved(b, pose));
  }
}

// Cells of 5 x 5 x 5, solid or not; solids hang together through faces only.
class Cells {
 public:
  static constexpr int kSide = 5;
  bool& At(int x, int y, int z) { return solid_[x + 1][y + 1][z + 1]; }
  // Of the surface around a corner of eight cells: each region of solid cells that share faces has
  // one more than holes in it, which its Euler number tells.
  template <typename At>
  static int64_t Fans(const At& at) {
    int region[8], fans = 0;
    for (int d = 0; d < 8; ++d) region[d] = at(d) ? d : -1;
    for (int round = 0; round < 8; ++round) {
      for (int d = 0; d < 8; ++d) {
        for (int axis = 0; axis < 3 && at(d); ++axis) {
          const int other = d ^ 1 << axis;
          if (at(other)) region[d] = region[other] = std::min(region[d], region[other]);
        }
      }
    }
    for (int r = 0; r < 8; ++r) {
      if (region[r] != r) continue;
      int euler = 0;
      for (int d = 0; d < 8; ++d) {
        if (region[d] != r) continue;
        ++euler;
        for (int axis = 0; axis < 3; ++axis) {
          const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
          if ((d & 1 << axis) == 0 && at(d ^ 1 << axis)) --euler;
          if ((d & (u | v)) == 0 && at(d | u) && at(d | v) && at(d | u | v)) ++euler;
        }
      }
      fans += 2 - euler;
    }
    return fans;
  }
  // Of the surface, with solids that share an edge or a corner apart there.
  int64_t Euler() const {
    int64_t euler = 0;
    for (int x = 0; x <= kSide; ++x) {
      for (int y = 0; y <= kSide; ++y) {
        for (int z = 0; z <= kSide; ++z) {
          const auto at = [&](int d) {
            return solid_[x + (d & 1)][y + (d >> 1 & 1)][z + (d >> 2)];
          };
          for (int axis = 0; axis < 3; ++axis) {
            const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3;
            euler += at(0) != at(1 << axis) ? 1 : 0;
            euler -= ((at(0) != at(u)) + (at(u) != at(u | v)) + (at(u | v) != at(v)) +
                      (at(v) != at(0))) /
                     2;
          }
          euler += Fans(at);
        }
      }
    }
    return euler;
  }
  double Volume(const std::array<std::array<double, kSide + 1>, 3>& lines) const {
    double volume = 0;
    for (int x = 0; x < kSide; ++x) {
      for (int y = 0; y < kSide; ++y) {
        for (int z = 0; z < kSide; ++z) {
          if (!solid_[x + 1][y + 1][z + 1]) continue;
          volume += (lines[0][x + 1] - lines[0][x]) * (lines[1][y + 1] - lines[1][y]) *
                    (lines[2][z + 1] - lines[2][z]);
        }
      }
    }
    return volume;
  }
  int64_t Count() const {
    const bool* first = &solid_[0][0][0];
    return std::count(first, first + sizeof(solid_), true);
  }

 private:
  bool solid_[kSide + 2][kSide + 2][kSide + 2] = {};
};

// Of the planes between the cells of a grid, by axis.
using GridLines = std::array<std::array<double, Cells::kSide + 1>, 3>;

GridLines EvenLines() {
  GridLines lines;
  for (auto& of_axis : lines) std::iota(of_axis.begin(), of_axis.end(), 0.0);
  return lines;
}

// Pairs of planes, a thousandth apart.
GridLines NearLines(std::mt19937_64& random) {
  std::uniform_real_distribution<double> part(0, 1);
  GridLines lines;
  for (auto& of_axis : lines) {
    for (size_t k = 0; k < of_axis.size(); k += 2) {
      of_axis[k] = 4 * part(random);
      of_axis[k + 1] = of_axis[k] + 1e-3 * (0.5 + part(random));
    }
    std::sort(of_axis.begin(), of_axis.end());
  }
  return lines;
}

// Boxes on a grid, one after the other added, cut off, or cut with: all contacts there are. Where
// planes are near to each other some are refused, and none is wrong.
TEST(CombineSolidsTest, ChainsOfBoxesAreWhatTheirCellsSay) {
  std::mt19937_64 random(3);
  std::uniform_int_distribution<int> any(0, 1000);
  int compared = 0, refused = 0;
  for (int chain = 0; chain < 150; ++chain) {
    const Eigen::Affine3d pose = chain % 2 == 0 ? Eigen::Affine3d::Identity() : Askew();
    const bool is_near = chain % 3 == 2;
    const GridLines lines = is_near ? NearLines(random) : EvenLines();
    std::optional<TriangleMesh> mesh;
    Cells cells;
    for (int step = 0; step < 5; ++step) {
      SCOPED_TRACE(testing::Message() << "chain " << chain << " step " << step);
      int low[3], high[3];
      for (int k = 0; k < 3; ++k) {
        low[k] = any(random) % 4;
        high[k] = low[k] + 1 + any(random) % (Cells::kSide - low[k]);
      }
      const auto corner = [&](const int(&of)[3]) {
        return Eigen::Vector3d(lines[0][of[0]], lines[1][of[1]], lines[2][of[2]]);
      };
      const TriangleMesh box = Moved(BoxMesh(corner(low), corner(high)), pose);
      const int operation = mesh ? (any(random) % 5 + 1) % 5 / 2 : 0;
      for (int x = 0; x < Cells::kSide; ++x) {
        for (int y = 0; y < Cells::kSide; ++y) {
          for (int z = 0; z < Cells::kSide; ++z) {
            const bool in = low[0] <= x && x < high[0] && low[1] <= y && y < high[1] &&
                            low[2] <= z && z < high[2];
            bool& cell = cells.At(x, y, z);
            cell = operation == 0 ? cell || in : operation == 1 ? cell && in : cell && !in;
          }
        }
      }
      if (!mesh) {
        mesh = box;
        continue;
      }
      const auto made = CombineSolids(*mesh, box, kOperations[operation], RunContext());
      if (is_near && !made.ok() && cells.Count() > 0) {
        EXPECT_THAT(std::string(made.status().message()), HasSubstr("too flat an angle"));
        ++refused;
        break;
      }
      ASSERT_EQ(made.ok(), cells.Count() > 0) << made.status();
      if (!made.ok()) break;
      mesh = made->mesh;
      const auto count = static_cast<int>(mesh->vertices.cols());
      ASSERT_TRUE(BuildMeshTopology(mesh->triangles, count).ok());
      const TopologySummary summary = SummarizeTopology(mesh->triangles, count);
      EXPECT_TRUE(summary.closed());
      EXPECT_EQ(summary.euler, cells.Euler());
      EXPECT_NEAR(VolumeOf(*mesh), cells.Volume(lines), 1e-8);
      ++compared;
    }
  }
  EXPECT_GT(compared, 300);
  EXPECT_LE(refused, 3);
}

// Two boxes with a part of an edge in common whose ends no grid holds: the neck there has no thin
// triangle, because a crossing along the edge lies anywhere.
TEST(CombineSolidsTest, AnEdgeInCommonJoinsNothing) {
  const TriangleMesh slab = BoxMesh({1.2588518855573101, 1.5948147494190921, 1.9588941836474516},
                                    {3.1131244477859283, 2.1956029621292759, 1.9604301920511145}),
                     block = BoxMesh({3.1131244477859283, 1.5948147494190921, 0.88870298005801518},
                                     {3.8906340737299505, 2.1956029621292759, 1.9588941836474516});
  EXPECT_EQ(Combined(slab, block, SolidOperation::kUnion).shape, Is(2, 0));
}

TEST(CombineSolidsTest, ResultDoesNotDependOnThreads) {
  const TriangleMesh a = SphereMesh(5), b = Moved(TorusMesh(.9, .3, 80, 40), Askew());
  for (const SolidOperation operation : kOperations) {
    RunContext one, three;
    one.threads = 1;
    three.threads = 3;
    const auto first = CombineSolids(a, b, operation, one);
    const auto second = CombineSolids(a, b, operation, three);
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_GT(first->crossings, 100);
    EXPECT_EQ(first->mesh.vertices, second->mesh.vertices);
    EXPECT_EQ(first->mesh.triangles, second->mesh.triangles);
  }
}

TEST(CombineSolidsTest, WhatIsNotCutStaysAsItIs) {
  const TriangleMesh a = SphereMesh(3), b = Moved(a, By(1.5, 0, 0));
  const auto united = CombineSolids(a, b, SolidOperation::kUnion, RunContext());
  ASSERT_TRUE(united.ok());
  int kept = 0;
  for (const auto vertex : a.vertices.colwise()) {
    if (vertex.x() > .5) continue;
    bool found = false;
    for (const auto other : united->mesh.vertices.colwise()) found = found || other == vertex;
    EXPECT_TRUE(found);
    ++kept;
  }
  EXPECT_GT(kept, 100);
}

std::string Refusal(const TriangleMesh& a, const TriangleMesh& b) {
  const auto made = CombineSolids(a, b, SolidOperation::kUnion, RunContext());
  return made.ok() ? "" : std::string(made.status().message());
}

TEST(CombineSolidsTest, WhatIsNoSolidIsRefused) {
  const TriangleMesh box = UnitBox(0, 0, 0);
  TriangleMesh open = box;
  open.triangles = Eigen::Matrix3Xi(box.triangles.leftCols(11));
  EXPECT_THAT(Refusal(open, box), HasSubstr("the first shape is open: 3 of its edges"));
  EXPECT_THAT(Refusal(box, open), HasSubstr("the second shape is open"));
  EXPECT_THAT(Refusal(box, InsideOut(box)), HasSubstr("the second shape is inside out"));
  TriangleMesh turned = box;
  std::swap(turned.triangles(0, 5), turned.triangles(1, 5));
  EXPECT_THAT(Refusal(turned, box), HasSubstr("is no solid"));
  TriangleMesh far = box;
  far.vertices(1, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(Refusal(box, far), HasSubstr("not finite"));
  EXPECT_THAT(Refusal(box, TriangleMesh()), HasSubstr("no triangles"));
  // Two overlapping boxes in one mesh, cut where they overlap.
  const TriangleMesh twice = Together(box, UnitBox(.5, .1, .2));
  EXPECT_THAT(Refusal(twice, UnitBox(.6, .3, .4)), HasSubstr("overlaps itself"));
}

TEST(CombineSolidsTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const auto made = CombineSolids(SphereMesh(4), SphereMesh(4), SolidOperation::kUnion, context);
  EXPECT_EQ(made.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
