#include "core/codec/bytes/magnitude_class.h"

#include "gtest/gtest.h"

namespace rilievo {
namespace {

TEST(MagnitudeClassTest, TwoClassesAnOctave) {
  const int classes[] = {0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 6, 6, 7, 7, 7, 7, 8};
  for (int quarters = 0; quarters <= 16; ++quarters) {
    EXPECT_EQ(MagnitudeClass(quarters, 100), classes[quarters]) << quarters;
  }
  EXPECT_EQ(MagnitudeClass(int64_t{1} << 40, 15), 15);
  EXPECT_EQ(MagnitudeClass(3, 2), 2);
}

}  // namespace
}  // namespace rilievo
