#include "server/auth/certificate_copies.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

namespace rilievo {
namespace {

std::string TextOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

class CertificateCopiesTest : public testing::Test {
 protected:
  void SetUp() override {
    Write(certificate_, "one");
    Write(key_, "one");
  }
  void TearDown() override {
    std::filesystem::remove(certificate_);
    std::filesystem::remove(key_);
  }

  static void Write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }

  // Good are two files that hold the same, and anything at all.
  std::unique_ptr<CertificateCopies> Watch() const {
    return CertificateCopies::Watch({key_, certificate_, ""},
                                    [](const std::vector<std::string>& paths) {
                                      const std::string text = TextOf(paths[0]);
                                      if (!text.empty() && text == TextOf(paths[1])) {
                                        return absl::OkStatus();
                                      }
                                      return absl::InvalidArgumentError("they do not match");
                                    })
        .value();
  }

  static bool Becomes(const std::string& path, const std::string& text) {
    for (int i = 0; i < 100; ++i) {
      if (TextOf(path) == text) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }

  // Of this process alone: several may test at once.
  const std::string prefix_ = testing::TempDir() + "copies_" + std::to_string(getpid());
  const std::string certificate_ = prefix_ + "_certificate.pem";
  const std::string key_ = prefix_ + "_key.pem";
};

TEST_F(CertificateCopiesTest, HoldWhatTheFilesHold) {
  const auto copies = Watch();
  ASSERT_EQ(copies->paths().size(), 3u);
  EXPECT_EQ(TextOf(copies->paths()[0]), "one");
  EXPECT_EQ(TextOf(copies->paths()[1]), "one");
  EXPECT_EQ(copies->paths()[2], "");
}

TEST_F(CertificateCopiesTest, FollowOnlyFromOneGoodStateToAnother) {
  const auto copies = Watch();
  const std::vector<std::string> paths = copies->paths();
  for (const char* half : {"", "two"}) {
    Write(certificate_, half);
    std::this_thread::sleep_for(std::chrono::milliseconds(2200));
    EXPECT_EQ(TextOf(paths[0]), "one");
    EXPECT_EQ(TextOf(paths[1]), "one");
  }
  Write(key_, "two");
  EXPECT_TRUE(Becomes(paths[0], "two"));
  EXPECT_TRUE(Becomes(paths[1], "two"));
}

TEST_F(CertificateCopiesTest, AFileThatIsNotThereIsRefused) {
  const auto copies = CertificateCopies::Watch(
      {key_ + ".none"}, [](const std::vector<std::string>&) { return absl::OkStatus(); });
  EXPECT_EQ(copies.status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace rilievo
