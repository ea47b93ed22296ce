#include "core/base/sha256.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "absl/strings/escaping.h"

namespace rilievo {
namespace {

std::string Hex(const std::string& text, size_t piece) {
  Sha256 hash;
  const std::vector<uint8_t> bytes(text.begin(), text.end());
  for (size_t at = 0; at < bytes.size(); at += piece) {
    hash.Add(std::span(bytes).subspan(at, std::min(piece, bytes.size() - at)));
  }
  const auto digest = hash.Finish();
  return absl::BytesToHexString(std::string(digest.begin(), digest.end()));
}

// The examples of NIST's "Cryptographic Standards and Guidelines" for SHA-256.
TEST(Sha256Test, TheStandardsExamples) {
  EXPECT_EQ(Hex("", 1), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Hex("abc", 3), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", 56),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(Hex(std::string(1000000, 'a'), 1000),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256Test, PiecesDoNotMatter) {
  const std::string text(200, 'x');
  for (size_t piece : {1, 7, 55, 56, 63, 64, 65, 119, 128}) {
    EXPECT_EQ(Hex(text, piece), Hex(text, 200)) << piece;
  }
}

}  // namespace
}  // namespace rilievo
