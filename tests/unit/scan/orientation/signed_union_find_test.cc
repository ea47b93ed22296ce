#include "core/scan/orientation/signed_union_find.h"

#include <gtest/gtest.h>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

// Against signs known beforehand: whatever the order of the joins, each element keeps its relation
// to every other of its set.
TEST(SignedUnionFindTest, ParitiesFollowFromAnyOrderOfJoins) {
  constexpr int kPoints = 500;
  Random random(1);
  for (int round = 0; round < 20; ++round) {
    std::vector<int> sign(kPoints);
    for (int& s : sign) s = static_cast<int>(random.Below(2));
    SignedUnionFind sets(kPoints);
    int joins = 0;
    for (int i = 0; i < 5000; ++i) {
      const int a = static_cast<int>(random.Below(kPoints));
      const int b = static_cast<int>(random.Below(kPoints));
      if (a != b && sets.Join(a, b, static_cast<uint8_t>(sign[a] ^ sign[b]))) ++joins;
    }
    EXPECT_EQ(joins, kPoints - 1);
    const int root = sets.Find(0);
    EXPECT_EQ(sets.size(root), kPoints);
    for (int i = 0; i < kPoints; ++i) {
      ASSERT_EQ(sets.Find(i), root);
      ASSERT_EQ(sets.parity(i), sign[i] ^ sign[root]);
    }
  }
}

TEST(SignedUnionFindTest, JoiningWithinASetChangesNothing) {
  SignedUnionFind sets(3);
  EXPECT_TRUE(sets.Join(0, 1, 1));
  EXPECT_FALSE(sets.Join(1, 0, 0));
  sets.Find(0);
  sets.Find(1);
  EXPECT_NE(sets.parity(0), sets.parity(1));
  EXPECT_NE(sets.Find(2), sets.Find(0));
}

}  // namespace
}  // namespace rilievo
