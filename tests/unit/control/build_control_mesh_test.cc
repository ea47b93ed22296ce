#include "core/control/build_control_mesh.h"

#include <gtest/gtest.h>

#include "core/control/settings.h"
#include "core/control/spherical/octahedron.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

absl::StatusOr<ControlMeshResult> Build(OrientedCloud cloud, const ControlOptions& options,
                                        const RunContext& context = RunContext()) {
  const PointIndex index(cloud.points);
  auto graph = BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext());
  if (!graph.ok()) return graph.status();
  return BuildControlMesh(std::move(cloud), *graph, index, SpatialFrame{}, options, context);
}

TEST(BuildControlMesh, AutoTakesThePlanarRoadOverATerrain) {
  const auto result = Build(TerrainCloud(9000, 0.12), ControlOptions{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->topology, Topology::kPlanar);
  EXPECT_EQ(result->components, 1);
  EXPECT_EQ(result->boundary_loops, 2);
  EXPECT_EQ(result->genus, 0);
  EXPECT_NE(result->reason.find("height field"), std::string::npos);
}

TEST(BuildControlMesh, AutoTakesTheSphericalRoadAroundAStar) {
  const auto result = Build(StarCloud(9218), ControlOptions{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->topology, Topology::kSpherical);
  EXPECT_EQ(result->boundary_loops, 0);
}

TEST(BuildControlMesh, ABeltWithoutPointsStaysOpenUnlessBordersAreClosed) {
  // A tenth of the sphere's area.
  const OrientedCloud sphere = SphereCloud(12000);
  std::vector<int> kept;
  for (int i = 0; i < sphere.points.cols(); ++i) {
    if (std::abs(sphere.normals(2, i)) > 0.1) kept.push_back(i);
  }
  const OrientedCloud caps =
      MakeCloud(sphere.points(Eigen::all, kept), sphere.normals(Eigen::all, kept));
  ControlOptions options;
  const auto open = Build(caps, options);
  ASSERT_TRUE(open.ok()) << open.status();
  EXPECT_EQ(open->components, 2);
  EXPECT_EQ(open->boundary_loops, 2);
  EXPECT_NE(open->reason.find("openings"), std::string::npos);
  options.boundary = BoundaryRule::kClose;
  const auto closed = Build(caps, options);
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_EQ(closed->components, 1);
  EXPECT_EQ(closed->boundary_loops, 0);
}

TEST(BuildControlMesh, AHoleOfATerrainIsClosedWhereItsRimIsShort) {
  ControlOptions options;
  options.close_holes_below = 0.6;  // the rim is .75 long
  EXPECT_EQ(Build(TerrainCloud(9000, 0.12), options)->boundary_loops, 2);
  options.close_holes_below = 1;
  const auto closed = Build(TerrainCloud(9000, 0.12), options);
  ASSERT_TRUE(closed.ok()) << closed.status();
  EXPECT_EQ(closed->topology, Topology::kPlanar);
  EXPECT_EQ(closed->boundary_loops, 1);
}

TEST(BuildControlMesh, AutoFindsTheHandleOfATorus) {
  const auto result = Build(TorusCloud(200, 80), ControlOptions{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->topology, Topology::kArbitrary);
  EXPECT_EQ(result->components, 1);
  EXPECT_EQ(result->genus, 1);
  EXPECT_EQ(result->boundary_loops, 0);
}

TEST(BuildControlMesh, AnUnfitRoadIsRefusedWhenAskedFor) {
  ControlOptions options;
  options.topology = Topology::kPlanar;
  EXPECT_EQ(Build(SphereCloud(5000), options).status().code(),
            absl::StatusCode::kFailedPrecondition);
  options.topology = Topology::kSpherical;
  EXPECT_EQ(Build(TorusCloud(120, 50), options).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(BuildControlMesh, FacesThatNoPointTellsOfAreNotMade) {
  EXPECT_EQ(UsefulControlFaces(200000, 20), 200);
  EXPECT_EQ(UsefulControlFaces(200000, 1000), 4000);
  EXPECT_EQ(UsefulControlFaces(3000, 1000), 3000);
  ControlOptions options;
  options.target_faces = 200000;
  for (const OrientedCloud& cloud : {TerrainCloud(1000, 0.12), StarCloud(1000)}) {
    const auto result = Build(cloud, options);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_LT(result->mesh.faces.cols(), 8000);
  }
}

TEST(BuildControlMesh, AUserMeshIsTaken) {
  const Octahedron octahedron(2);
  ControlOptions options;
  options.user_mesh = ControlMesh{0.28 * octahedron.directions(), octahedron.faces()};
  for (const Topology topology : {Topology::kAuto, Topology::kUser}) {
    options.topology = topology;
    const auto result = Build(SphereCloud(2000), options);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(result->topology, Topology::kUser);
    EXPECT_EQ(result->mesh.faces, octahedron.faces());
  }
}

TEST(BuildControlMesh, TagsOfAUserMeshAreKeptAndMustBeItsOwn) {
  const Octahedron octahedron(2);
  const Eigen::Matrix3Xi faces = octahedron.faces();
  const int a = faces.col(0).minCoeff(), b = faces.col(0).maxCoeff();
  ControlOptions options;
  options.user_mesh = ControlMesh{0.28 * octahedron.directions(), faces, {{a, b, 1.5f}}, {b}};
  const auto result = Build(SphereCloud(2000), options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->mesh.creases, options.user_mesh->creases);
  EXPECT_EQ(result->mesh.corners, options.user_mesh->corners);
  options.user_mesh->corners = {static_cast<int>(octahedron.directions().cols())};
  EXPECT_TRUE(absl::IsInvalidArgument(Build(SphereCloud(2000), options).status()));
}

TEST(BuildControlMesh, TargetFacesIsObeyed) {
  ControlOptions options;
  options.target_faces = 600;
  const auto result = Build(TerrainCloud(9000, 0), options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_NEAR(static_cast<double>(result->mesh.faces.cols()), 600, 60);
}

TEST(BuildControlMesh, ReportsAndStops) {
  RunContext context;
  double last = -1;
  context.progress = [&](const Progress& progress) {
    EXPECT_EQ(progress.stage, Stage::kControlMesh);
    EXPECT_GE(progress.fraction, last);
    last = progress.fraction;
  };
  ASSERT_TRUE(Build(TerrainCloud(3000, 0), ControlOptions{}, context).ok());
  EXPECT_EQ(last, 1);
  EXPECT_EQ(Build(TerrainCloud(3000, 0), ControlOptions{}, Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(ControlOptions, Validate) {
  ControlOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.target_faces = -1;
  EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
  options.target_faces = 200001;
  EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
  options = ControlOptions();
  options.topology = Topology::kUser;
  EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
  options.topology = Topology::kPlanar;
  options.user_mesh = ControlMesh();
  EXPECT_EQ(options.Validate().code(), absl::StatusCode::kInvalidArgument);
}

TEST(DefaultControlFaces, FollowsThePointsWithinBounds) {
  EXPECT_EQ(DefaultControlFaces(20), 200);
  EXPECT_EQ(DefaultControlFaces(30'000), 1000);
  EXPECT_EQ(DefaultControlFaces(1'000'000), 12'000);
  EXPECT_EQ(DefaultControlFaces(3'000'000), 25'000);
  EXPECT_EQ(DefaultControlFaces(1'000'000'000), kControlOptions.most_control_faces);
}

TEST(TopologyName, NamesAreTheCommandLines) {
  EXPECT_STREQ(TopologyName(Topology::kAuto), "auto");
  EXPECT_STREQ(TopologyName(Topology::kPlanar), "planar");
  EXPECT_STREQ(TopologyName(Topology::kSpherical), "spherical");
  EXPECT_STREQ(TopologyName(Topology::kArbitrary), "arbitrary");
  EXPECT_STREQ(TopologyName(Topology::kUser), "user");
}

}  // namespace
}  // namespace rilievo
