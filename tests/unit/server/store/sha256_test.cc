#include "server/store/sha256.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

// FIPS 180-4 examples.
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kEmpty[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

TEST(Sha256, StandardVectors) {
  EXPECT_EQ(Sha256Hex("abc"), kAbc);
  EXPECT_EQ(Sha256Hex(""), kEmpty);
}

TEST(Sha256, PiecesAndHexInBetweenChangeNothing) {
  Sha256 hash;
  EXPECT_EQ(hash.Hex(), kEmpty);
  hash.Update("a", 1);
  EXPECT_EQ(hash.Hex(), Sha256Hex("a"));
  hash.Update("bc", 2);
  EXPECT_EQ(hash.Hex(), kAbc);
}

TEST(Sha256, KnowsItsOwnForm) {
  EXPECT_TRUE(IsSha256Hex(kAbc));
  EXPECT_FALSE(IsSha256Hex(std::string(kAbc) + "0"));
  EXPECT_FALSE(IsSha256Hex(std::string(64, 'A')));
  EXPECT_FALSE(IsSha256Hex("../" + std::string(61, 'a')));
}

}  // namespace
}  // namespace rilievo
