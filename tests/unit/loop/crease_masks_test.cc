#include "core/loop/crease_masks.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/loop/loop_masks.h"

namespace rilievo {
namespace {

constexpr float kSharp = kInfiniteSharpness;

SharpRing RingOf(int valence, const std::vector<int>& spokes, float sharpness = kSharp) {
  SharpRing ring;
  ring.sharpness.assign(static_cast<size_t>(valence), 0.0f);
  for (int spoke : spokes) ring.sharpness[static_cast<size_t>(spoke)] = sharpness;
  return ring;
}

SharpRing BoundaryRing(int valence, const std::vector<int>& spokes, float sharpness = kSharp) {
  SharpRing ring = RingOf(valence, spokes, sharpness);
  ring.sharpness.front() = ring.sharpness.back() = kSharp;
  ring.boundary = true;
  return ring;
}

// The subdivision matrix of a vertex (row 0) and its ring, row by row from the rules. `vertex`: the
// row of the vertex.
Eigen::MatrixXd RingMatrix(const SharpRing& ring, const std::vector<double>& vertex) {
  const int n = static_cast<int>(ring.sharpness.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1, n + 1);
  for (int i = 0; i <= n; ++i) matrix(0, i) = vertex[static_cast<size_t>(i)];
  for (int i = 0; i < n; ++i) {
    const double w = std::min(1.0, static_cast<double>(ring.sharpness[static_cast<size_t>(i)]));
    matrix(1 + i, 0) += w / 2 + (1 - w) * 3 / 8;
    matrix(1 + i, 1 + i) += w / 2 + (1 - w) * 3 / 8;
    matrix(1 + i, 1 + (i + 1) % n) += (1 - w) / 8;
    matrix(1 + i, 1 + (i + n - 1) % n) += (1 - w) / 8;
  }
  return matrix;
}

Eigen::MatrixXd RingMatrix(const SharpRing& ring) {
  return RingMatrix(ring, SharpVertexWeights(ring));
}

Eigen::RowVectorXd Row(const std::vector<double>& weights) {
  return Eigen::Map<const Eigen::RowVectorXd>(weights.data(),
                                              static_cast<Eigen::Index>(weights.size()));
}

std::vector<double> CreaseWeights(int valence, int a, int b) {
  std::vector<double> weights(static_cast<size_t>(valence) + 1, 0.0);
  weights[0] = 0.75;
  weights[static_cast<size_t>(1 + a)] = weights[static_cast<size_t>(1 + b)] = 0.125;
  return weights;
}

void ExpectWeights(const std::vector<double>& weights, const std::vector<double>& expected) {
  ASSERT_EQ(weights.size(), expected.size());
  for (size_t i = 0; i < weights.size(); ++i) EXPECT_NEAR(weights[i], expected[i], 1e-7) << i;
}

TEST(SharpnessOfHalvesTest, LosesOneALevel) {
  EXPECT_EQ(SharpnessOfHalves(0.0f), 0.0f);
  EXPECT_EQ(SharpnessOfHalves(0.7f), 0.0f);
  EXPECT_EQ(SharpnessOfHalves(1.0f), 0.0f);
  EXPECT_EQ(SharpnessOfHalves(2.5f), 1.5f);
  EXPECT_EQ(SharpnessOfHalves(9.5f), 8.5f);
  EXPECT_EQ(SharpnessOfHalves(10.0f), 10.0f);
  EXPECT_EQ(SharpnessOfHalves(1e9f), 10.0f);
}

TEST(SharpVertexWeightsTest, FollowTheKind) {
  std::vector<double> smooth(8, LoopBeta(7)), fixed(8, 0.0);
  smooth[0] = 1.0 - 7 * LoopBeta(7);
  fixed[0] = 1.0;
  ExpectWeights(SharpVertexWeights(RingOf(7, {})), smooth);
  ExpectWeights(SharpVertexWeights(RingOf(7, {4})), smooth);
  ExpectWeights(SharpVertexWeights(RingOf(7, {4, 6})), CreaseWeights(7, 4, 6));
  ExpectWeights(SharpVertexWeights(RingOf(7, {4, 6}, 1.5f)), CreaseWeights(7, 4, 6));
  ExpectWeights(SharpVertexWeights(RingOf(7, {0, 4, 6})), fixed);
  ExpectWeights(SharpVertexWeights(BoundaryRing(7, {})), CreaseWeights(7, 0, 6));
  ExpectWeights(SharpVertexWeights(BoundaryRing(7, {2})), fixed);
  SharpRing corner = RingOf(7, {});
  corner.corner = true;
  ExpectWeights(SharpVertexWeights(corner), fixed);
}

TEST(SharpVertexWeightsTest, BlendWhenTheKindChanges) {
  const auto blend = [](double w, const std::vector<double>& x, const std::vector<double>& y) {
    std::vector<double> sum(x.size());
    for (size_t i = 0; i < x.size(); ++i) sum[i] = w * x[i] + (1 - w) * y[i];
    return sum;
  };
  std::vector<double> smooth(8, LoopBeta(7)), fixed(8, 0.0);
  smooth[0] = 1.0 - 7 * LoopBeta(7);
  fixed[0] = 1.0;
  // A crease of 0.4 goes smooth; two of 0.2 and 0.6 do so by their mean.
  ExpectWeights(SharpVertexWeights(RingOf(7, {1, 3}, 0.4f)),
                blend(0.4, CreaseWeights(7, 1, 3), smooth));
  SharpRing ring = RingOf(7, {1, 3}, 0.2f);
  ring.sharpness[3] = 0.6f;
  ExpectWeights(SharpVertexWeights(ring), blend(0.4, CreaseWeights(7, 1, 3), smooth));
  // A corner loses its third edge, and is the crease of the other two.
  ring = RingOf(7, {0, 5});
  ring.sharpness[2] = 0.3f;
  ExpectWeights(SharpVertexWeights(ring), blend(0.3, fixed, CreaseWeights(7, 0, 5)));
  ExpectWeights(SharpVertexWeights(BoundaryRing(7, {2}, 0.3f)),
                blend(0.3, fixed, CreaseWeights(7, 0, 6)));
  // A crease loses one edge of two: a dart.
  ring = RingOf(7, {0});
  ring.sharpness[2] = 0.3f;
  ExpectWeights(SharpVertexWeights(ring), blend(0.3, CreaseWeights(7, 0, 2), smooth));
}

class SettledRingTest : public ::testing::TestWithParam<int> {};

TEST_P(SettledRingTest, MasksAreBalancedLeftEigenvectors) {
  const int n = GetParam();
  for (const SharpRing& ring :
       {RingOf(n, {1}), RingOf(n, {0, n - 1}), RingOf(n, {1, 1 + n / 2}), BoundaryRing(n, {}),
        BoundaryRing(n, {n / 2}), RingOf(n, {0, 1, n - 1})}) {
    const SharpLimitMask mask = SharpLimit(ring);
    const Eigen::MatrixXd matrix = RingMatrix(ring);
    EXPECT_NEAR(Row(mask.position).sum(), 1.0, 1e-13);
    EXPECT_LT((Row(mask.position) * matrix - Row(mask.position)).cwiseAbs().maxCoeff(), 1e-13);
    for (const SharpSector& sector : mask.sectors) {
      for (const auto& weights : {sector.tangent_u, sector.tangent_v}) {
        const Eigen::RowVectorXd tangent = Row(weights);
        EXPECT_NEAR(tangent.sum(), 0.0, 1e-11 * tangent.norm());
        if (std::count_if(ring.sharpness.begin(), ring.sharpness.end(),
                          [](float s) { return s > 0; }) > 2) {
          continue;  // corners have no tangent plane
        }
        const Eigen::RowVectorXd next = tangent * matrix;
        const double eigenvalue = next.dot(tangent) / tangent.squaredNorm();
        EXPECT_LT((next - eigenvalue * tangent).norm(), 1e-12 * tangent.norm());
      }
    }
  }
}

TEST_P(SettledRingTest, DartTangentsAreTheSubdominantPair) {
  const int n = GetParam();
  const SharpRing ring = RingOf(n, {1});
  const Eigen::MatrixXd matrix = RingMatrix(ring);
  Eigen::VectorXd all = Eigen::EigenSolver<Eigen::MatrixXd>(matrix).eigenvalues().real();
  std::sort(all.begin(), all.end(), std::greater<>());
  EXPECT_NEAR(all[0], 1.0, 1e-12);
  const SharpSector sector = SharpLimit(ring).sectors.front();
  std::vector<double> ours;
  for (const auto& weights : {sector.tangent_u, sector.tangent_v}) {
    ours.push_back((Row(weights) * matrix).dot(Row(weights)) / Row(weights).squaredNorm());
  }
  std::sort(ours.begin(), ours.end(), std::greater<>());
  EXPECT_NEAR(ours[0], all[1], 1e-9);
  EXPECT_NEAR(ours[1], all[2], 1e-9);
  EXPECT_GT(all[2], all[3] + 1e-4);
}

// On a flat regular ring, and on a bent one, normals look outward.
TEST_P(SettledRingTest, NormalsLookOutward) {
  const int n = GetParam();
  std::vector<SharpRing> rings = {RingOf(n, {1}),
                                  RingOf(n, {0, n - 1}),
                                  RingOf(n, {1, 1 + n / 2}),
                                  RingOf(n, {0, 1, n - 1}),
                                  RingOf(n, {0, n / 3, 2 * n / 3}),
                                  BoundaryRing(n, {}),
                                  BoundaryRing(n, {n / 2})};
  rings.push_back(RingOf(n, {1, 2}));
  rings.back().corner = true;
  for (const SharpRing& ring : rings) {
    const SharpLimitMask mask = SharpLimit(ring);
    const double step = 2.0 * std::numbers::pi / (ring.boundary ? 2 * (n - 1) : n);
    for (const SharpSector& sector : mask.sectors) {
      Eigen::Vector2d u = Eigen::Vector2d::Zero(), v = Eigen::Vector2d::Zero();
      for (int i = 0; i < n; ++i) {
        const Eigen::Vector2d neighbor(std::cos(i * step), std::sin(i * step));
        u += sector.tangent_u[static_cast<size_t>(1 + i)] * neighbor;
        v += sector.tangent_v[static_cast<size_t>(1 + i)] * neighbor;
      }
      // A sector of one face over 180 degrees or more has no inside.
      if (sector.face_count == 1 && step > 3.1) continue;
      EXPECT_GT(u[0] * v[1] - u[1] * v[0], 1e-3 * u.norm() * v.norm())
          << "faces " << sector.face_count << " of " << n;
    }
  }
}

TEST_P(SettledRingTest, SectorsPartTheRing) {
  const int n = GetParam();
  for (const SharpRing& ring : {RingOf(n, {1}), RingOf(n, {1, n - 1}), RingOf(n, {0, 1, n - 1}),
                                BoundaryRing(n, {}), BoundaryRing(n, {n / 2})}) {
    const SharpLimitMask mask = SharpLimit(ring);
    int faces = 0;
    for (const SharpSector& sector : mask.sectors) {
      EXPECT_GT(ring.sharpness[static_cast<size_t>(sector.first % n)], 0.0f);
      faces += sector.face_count;
      for (int i = 1; i < sector.face_count; ++i) {
        if (mask.sectors.size() == 1) break;
        EXPECT_EQ(ring.sharpness[static_cast<size_t>((sector.first + i) % n)], 0.0f);
      }
    }
    EXPECT_EQ(faces, ring.boundary ? n - 1 : n);
  }
}

INSTANTIATE_TEST_SUITE_P(Valences, SettledRingTest,
                         ::testing::Values(3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 18, 33, 50, 120));

TEST(SharpLimitTest, DartOfHighValenceStaysFinite) {
  const SharpLimitMask mask = SharpLimit(RingOf(1000, {3}));
  EXPECT_NEAR(Row(mask.position).sum(), 1.0, 1e-12);
  EXPECT_TRUE(Row(mask.sectors[0].tangent_u).allFinite());
  const Eigen::MatrixXd matrix = RingMatrix(RingOf(1000, {3}));
  const Eigen::RowVectorXd u = Row(mask.sectors[0].tangent_u);
  const Eigen::RowVectorXd next = u * matrix;
  EXPECT_LT((next - next.dot(u) / u.squaredNorm() * u).norm(), 1e-8 * u.norm());
}

// The mask of a ring is that of the next level's ring after one step, however the kinds change.
TEST(SharpLimitTest, SemiSharpMasksFollowTheMatrices) {
  for (int n = 3; n <= 12; ++n) {
    for (const float first : {0.3f, 1.0f, 2.6f, kSharp}) {
      for (const float second : {0.0f, 0.8f, 1.9f, 9.5f}) {
        for (const bool boundary : {false, true}) {
          SharpRing ring = boundary ? BoundaryRing(n, {}) : RingOf(n, {});
          ring.sharpness[1] = first;
          ring.sharpness[static_cast<size_t>(n / 2)] = std::max(first, second);
          SharpRing next = ring;
          for (float& sharpness : next.sharpness) sharpness = SharpnessOfHalves(sharpness);
          const SharpLimitMask mask = SharpLimit(ring), next_mask = SharpLimit(next);
          const Eigen::MatrixXd matrix = RingMatrix(ring);
          EXPECT_LT((Row(mask.position) - Row(next_mask.position) * matrix).cwiseAbs().maxCoeff(),
                    1e-13);
          ASSERT_EQ(mask.sectors.size(), next_mask.sectors.size());
          for (size_t s = 0; s < mask.sectors.size(); ++s) {
            const Eigen::RowVectorXd ours = Row(mask.sectors[s].tangent_u).normalized();
            const Eigen::RowVectorXd pulled = Row(next_mask.sectors[s].tangent_u) * matrix;
            if (next.sharpness == ring.sharpness) continue;
            EXPECT_LT((ours - pulled.normalized()).norm(), 1e-10);
          }
        }
      }
    }
  }
}

// A flat side of 270 degrees, and a crease that runs straight on: cases in which the two edges of a
// corner's side do not tell its normal.
TEST(SharpLimitTest, CornerSidesKnowTheirOutside) {
  const auto normal = [](const SharpSector& sector, const Eigen::Matrix3Xd& ring) {
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < ring.cols(); ++i) {
      u += sector.tangent_u[static_cast<size_t>(1 + i)] * ring.col(i);
      v += sector.tangent_v[static_cast<size_t>(1 + i)] * ring.col(i);
    }
    return Eigen::Vector3d(u.cross(v).normalized());
  };
  for (const double whole : {90.0, 180.0, 270.0, 315.0}) {
    for (int faces = whole > 270.0 ? 3 : 2; faces <= 8; ++faces) {
      // The side from edge 0 to `faces`, flat; a third sharp edge beneath.
      Eigen::Matrix3Xd ring(3, faces + 2);
      for (int i = 0; i <= faces; ++i) {
        const double angle = whole * std::numbers::pi / 180.0 * i / faces;
        ring.col(i) << std::cos(angle), std::sin(angle), 0.0;
      }
      ring.col(faces + 1) << 0, 0, -1;
      // Both edges a little raised, as where the creases are curved.
      ring(2, 0) = ring(2, faces) = 0.01;
      const SharpLimitMask mask = SharpLimit(RingOf(faces + 2, {0, faces, faces + 1}));
      ASSERT_EQ(mask.sectors.size(), 3u);
      EXPECT_GT(normal(mask.sectors[0], ring).z(), 0.99) << whole << " " << faces;
    }
  }
}

}  // namespace
}  // namespace rilievo
