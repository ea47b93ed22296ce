#include "server/store/content_name.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// FIPS 180-4 examples.
constexpr char kAbc[] = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr char kEmpty[] = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

TEST(ContentName, StandardVectorsInHexadecimal) {
  EXPECT_EQ(ContentNameOf("abc"), kAbc);
  EXPECT_EQ(ContentNameOf(""), kEmpty);
}

TEST(ContentName, AskingInBetweenChangesNothing) {
  Sha256 hash;
  EXPECT_EQ(ContentName(hash), kEmpty);
  AddBytes("a", 1, &hash);
  EXPECT_EQ(ContentName(hash), ContentNameOf("a"));
  AddBytes("bc", 2, &hash);
  EXPECT_EQ(ContentName(hash), kAbc);
}

TEST(ContentName, KnowsItsOwnForm) {
  EXPECT_TRUE(IsContentName(kAbc));
  EXPECT_FALSE(IsContentName(absl::StrCat(kAbc, "0")));
  EXPECT_FALSE(IsContentName(std::string(64, 'A')));
  EXPECT_FALSE(IsContentName(absl::StrCat("../", std::string(61, 'a'))));
}

}  // namespace
}  // namespace rilievo
