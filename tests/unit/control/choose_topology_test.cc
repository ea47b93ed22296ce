#include "core/control/choose_topology.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(ChooseTopology, TakesTheRoadOfEachShape) {
  EXPECT_EQ(ChooseTopology(TerrainCloud(10000, 0.1), RunContext{}).value().topology,
            Topology::kPlanar);
  EXPECT_EQ(ChooseTopology(SphereCloud(10000), RunContext{}).value().topology,
            Topology::kSpherical);
  EXPECT_EQ(ChooseTopology(StarCloud(10000), RunContext{}).value().topology, Topology::kSpherical);
  EXPECT_EQ(ChooseTopology(TorusCloud(160, 60), RunContext{}).value().topology,
            Topology::kArbitrary);
  EXPECT_EQ(ChooseTopology(Joined(SphereCloud(4000, 0.12, Vector3d(0.3, 0, 0)),
                                  SphereCloud(4000, 0.12, Vector3d(-0.3, 0, 0))),
                           RunContext{})
                .value()
                .topology,
            Topology::kArbitrary);
}

TEST(ChooseTopology, AnOpenSphereIsNotSpherical) {
  const OrientedCloud whole = SphereCloud(20000);
  std::vector<int> kept;
  for (int i = 0; i < 20000; ++i) {
    if (whole.points(2, i) > -0.24) kept.push_back(i);
  }
  const OrientedCloud open =
      MakeCloud(whole.points(Eigen::all, kept), whole.normals(Eigen::all, kept));
  EXPECT_EQ(ChooseTopology(open, RunContext{}).value().topology, Topology::kArbitrary);
}

TEST(ChooseTopology, TheOrderOfThePointsDoesNotMatter) {
  const OrientedCloud cloud = StarCloud(6000);
  const Eigen::Matrix3Xd points = cloud.points.rowwise().reverse();
  const Eigen::Matrix3Xd normals = cloud.normals.rowwise().reverse();
  EXPECT_EQ(ChooseTopology(MakeCloud(points, normals), RunContext{}).value().topology,
            ChooseTopology(cloud, RunContext{}).value().topology);
}

TEST(ChooseTopology, SaysWhyInOneSentence) {
  for (const OrientedCloud& cloud :
       {TerrainCloud(4000, 0), SphereCloud(4000), TorusCloud(100, 40)}) {
    const std::string reason = ChooseTopology(cloud, RunContext{}).value().reason;
    EXPECT_GT(reason.size(), 40U);
    EXPECT_EQ(reason.find('\n'), std::string::npos);
    EXPECT_EQ(reason.find(". "), std::string::npos);
  }
}

}  // namespace
}  // namespace rilievo
