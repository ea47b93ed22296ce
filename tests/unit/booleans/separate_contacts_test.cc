#include "core/booleans/separate_contacts.h"

#include <gtest/gtest.h>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

constexpr double kWidth = 1e-4;

TopologySummary Of(const TriangleMesh& mesh) {
  return SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
}

// Two boxes whose edges at x = y = 1 lie `gap` apart, joined by a strip there: what growing makes
// of an edge in common.
TriangleMesh JoinedAlongAnEdge(double neck) {
  const double low = 1 - neck, high = 1 + neck;
  std::vector<Eigen::Vector3d> p;
  // The outline seen from above, counter-clockwise, at z = 0 and z = 1.
  const Eigen::Vector2d outline[] = {{0, 0}, {1, 0}, {1, low},  {high, 1}, {2, 1},
                                     {2, 2}, {1, 2}, {1, high}, {low, 1},  {0, 1}};
  for (const double z : {0., 1.}) {
    for (const Eigen::Vector2d& at : outline) p.emplace_back(at.x(), at.y(), z);
  }
  std::vector<std::array<int, 3>> t;
  for (int i = 0; i < 10; ++i) {
    const int next = (i + 1) % 10;
    t.push_back({i, next, 10 + next});
    t.push_back({i, 10 + next, 10 + i});
  }
  const std::array<int, 3> lid[] = {{0, 1, 2}, {0, 2, 8}, {0, 8, 9}, {2, 3, 7},
                                    {2, 7, 8}, {3, 4, 5}, {3, 5, 7}, {5, 6, 7}};
  for (const auto& [a, b, c] : lid) {
    t.push_back({10 + a, 10 + b, 10 + c});
    t.push_back({a, c, b});
  }
  return MeshOf(p, t);
}

// Contacts may be everywhere.
std::vector<uint8_t> Everywhere(const TriangleMesh& mesh) {
  return std::vector<uint8_t>(static_cast<size_t>(mesh.vertices.cols()), 1);
}

TEST(SeparateContactsTest, ANarrowNeckIsTakenApart) {
  const TriangleMesh joined = JoinedAlongAnEdge(kWidth / 4);
  ASSERT_TRUE(Of(joined).closed() && Of(joined).components == 1);
  const auto apart = SeparateContacts(joined, Everywhere(joined), kWidth, RunContext());
  ASSERT_TRUE(apart.ok());
  EXPECT_TRUE(apart->touched);
  EXPECT_EQ(Of(apart->mesh).components, 2);
  EXPECT_TRUE(Of(apart->mesh).closed() && Of(apart->mesh).manifold());
  EXPECT_EQ(Of(apart->mesh).euler, 4);
  EXPECT_NEAR(VolumeOf(apart->mesh), 2, 1e-3);
}

TEST(SeparateContactsTest, AWiderOneStays) {
  const TriangleMesh joined = JoinedAlongAnEdge(100 * kWidth);
  const auto same = SeparateContacts(joined, Everywhere(joined), kWidth, RunContext());
  ASSERT_TRUE(same.ok());
  EXPECT_FALSE(same->touched);
  EXPECT_EQ(same->mesh.vertices, joined.vertices);
  EXPECT_EQ(same->mesh.triangles, joined.triangles);
}

TEST(SeparateContactsTest, OneWhereNothingTouchesStays) {
  const TriangleMesh joined = JoinedAlongAnEdge(kWidth / 4);
  const auto same = SeparateContacts(joined, {}, kWidth, RunContext());
  ASSERT_TRUE(same.ok());
  EXPECT_FALSE(same->touched);
  EXPECT_EQ(same->mesh.triangles, joined.triangles);
}

TEST(SeparateContactsTest, FilmsGo) {
  const TriangleMesh film = BoxMesh({3, 0, 0}, {4, 1, kWidth / 8});
  const TriangleMesh both = Together(UnitBox(0, 0, 0), film);
  const auto left = SeparateContacts(both, Everywhere(both), kWidth, RunContext());
  ASSERT_TRUE(left.ok());
  EXPECT_EQ(Of(left->mesh).components, 1);
  EXPECT_NEAR(VolumeOf(left->mesh), 1, 1e-12);
  const auto nothing = SeparateContacts(film, Everywhere(film), kWidth, RunContext());
  ASSERT_TRUE(nothing.ok());
  EXPECT_EQ(nothing->mesh.triangles.cols(), 0);
}

TEST(SeparateContactsTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const TriangleMesh joined = JoinedAlongAnEdge(kWidth / 4);
  const auto made = SeparateContacts(joined, Everywhere(joined), kWidth, context);
  EXPECT_EQ(made.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
