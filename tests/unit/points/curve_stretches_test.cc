#include "core/points/curve_stretches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/points/morton_order.h"
#include "tests/scans/random.h"

namespace rilievo {
namespace {

constexpr int64_t kLeast = 50;

// Of points on a sphere: more of them lie in some cells than in others.
std::vector<uint64_t> CodesOfSphere(int count, uint64_t seed) {
  Random random(seed);
  std::vector<uint64_t> codes;
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d at(random.Normal(), random.Normal(), 2 * random.Normal());
    at = 0.4 * at.normalized();
    codes.push_back(MortonCode(MortonCell(at.x()), MortonCell(at.y()), MortonCell(at.z())));
  }
  std::sort(codes.begin(), codes.end());
  return codes;
}

using CodeStretch = std::pair<uint64_t, uint64_t>;  // its first code and its last

std::set<CodeStretch> CodeStretches(const std::vector<uint64_t>& codes) {
  std::set<CodeStretch> stretches;
  int64_t begin = 0;
  for (const int64_t end : StretchEnds(codes, kLeast)) {
    stretches.insert({codes[begin], codes[end - 1]});
    begin = end;
  }
  return stretches;
}

TEST(CurveStretchesTest, EachHasEnoughAndTogetherTheyHaveAll) {
  const std::vector<uint64_t> codes = CodesOfSphere(20000, 1);
  const std::vector<int64_t> ends = StretchEnds(codes, kLeast);
  EXPECT_EQ(ends.back(), 20000);
  int64_t begin = 0;
  for (const int64_t end : ends) {
    EXPECT_GE(end - begin, kLeast);
    EXPECT_LE(end - begin, 6 * kLeast);
    begin = end;
  }
}

// Half of the sphere, cut along z, the highest bit of the curve: another number of points before
// what is kept. By rank from the first point all of its stretches would be others.
TEST(CurveStretchesTest, APartHasThoseOfTheWhole) {
  const std::vector<uint64_t> codes = CodesOfSphere(20001, 2);
  const uint64_t middle = MortonCode(0, 0, MortonCell(0));
  const auto cut = std::lower_bound(codes.begin(), codes.end(), middle);
  const std::set<CodeStretch> whole = CodeStretches(codes);
  for (const auto& part :
       {std::vector<uint64_t>(codes.begin(), cut), std::vector<uint64_t>(cut, codes.end())}) {
    for (const CodeStretch& stretch : CodeStretches(part)) EXPECT_TRUE(whole.contains(stretch));
  }
}

// A cut through cells moves the stretches beside it alone.
TEST(CurveStretchesTest, ACutThroughCellsMovesThoseBesideItAlone) {
  const std::vector<uint64_t> codes = CodesOfSphere(20000, 3);
  const std::set<CodeStretch> whole = CodeStretches(codes);
  const std::set<CodeStretch> part = CodeStretches({codes.begin() + 777, codes.end()});
  const auto others = std::count_if(part.begin(), part.end(), [&](const CodeStretch& stretch) {
    return !whole.contains(stretch);
  });
  EXPECT_LE(others, 3);
}

TEST(CurveStretchesTest, AShortCurveIsOne) {
  EXPECT_EQ(StretchEnds({7}, kLeast), std::vector<int64_t>{1});
  EXPECT_EQ(StretchEnds(std::vector<uint64_t>(90, 5), kLeast), std::vector<int64_t>{90});
}

// All at one place: no cell tells them apart.
TEST(CurveStretchesTest, PointsAtOnePlaceAreOne) {
  EXPECT_EQ(StretchEnds(std::vector<uint64_t>(1000, 5), kLeast), std::vector<int64_t>{1000});
}

TEST(CurveStretchesTest, CodesAscendInTheFrameOfTheCurve) {
  const Eigen::Matrix3Xd points{{-0.1, 0.1}, {0, 0}, {0, 0}};
  const std::vector<uint64_t> codes = CodesAlong(points, {{1, 0, 0}, 4}, RunContext{}).value();
  ASSERT_EQ(codes.size(), 2u);
  EXPECT_EQ(codes[0], MortonCode(MortonCell(-1.1 / 4), MortonCell(0), MortonCell(0)));
  EXPECT_EQ(codes[1], MortonCode(MortonCell(-0.9 / 4), MortonCell(0), MortonCell(0)));
}

// As after a change of frames: the first of three points on a face of the cells is rounded to the
// other side, far along the curve.
TEST(CurveStretchesTest, OnePointAcrossAFaceMovesNoOther) {
  const Eigen::Matrix3Xd points{
      {-0.3, -0.2, 1e-12, -1e-9, 0.1, 0.2}, {0, 0, 0, 0, 0, 0}, {-0.1, -0.1, -0.1, -0.1, 0.1, 0.1}};
  const std::vector<uint64_t> codes = CodesAlong(points, SpatialFrame(), RunContext{}).value();
  EXPECT_TRUE(std::is_sorted(codes.begin(), codes.end()));
  EXPECT_EQ(codes[2], codes[1]);
  for (const int i : {0, 1, 3, 4, 5}) {
    EXPECT_EQ(codes[i],
              MortonCode(MortonCell(points(0, i)), MortonCell(0), MortonCell(points(2, i))));
  }
}

}  // namespace
}  // namespace rilievo
