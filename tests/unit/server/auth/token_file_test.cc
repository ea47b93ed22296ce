#include "server/auth/token_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

// Until it is so, for 5 s.
template <typename Condition>
bool Soon(const Condition& condition) {
  for (int i = 0; i < 500 && !condition(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return condition();
}

class TokenFileTest : public testing::Test {
 protected:
  TestFolder test_;
  const std::string path_ = test_ / "tokens";
  const NewToken alice_ = *MakeToken("alice"), bob_ = *MakeToken("bob");
  std::atomic<int> complaints_{0};

  std::unique_ptr<TokenFile> Open() {
    auto file = TokenFile::Open(path_, [this](const absl::Status&) { ++complaints_; });
    EXPECT_TRUE(file.ok()) << file.status();
    return file.ok() ? *std::move(file) : nullptr;
  }
};

TEST_F(TokenFileTest, LinesAreAddedToAFileOfItsOwnerAlone) {
  ASSERT_TRUE(AddTokenLine(path_, alice_.line).ok());
  struct stat made {};
  ASSERT_EQ(stat(path_.c_str(), &made), 0);
  EXPECT_EQ(made.st_mode & 0777, 0600u);
  std::ofstream(path_, std::ios::app) << "# no line end";
  ASSERT_TRUE(AddTokenLine(path_, bob_.line).ok());
  const auto file = Open();
  EXPECT_EQ(file->OwnerOf(alice_.token), "alice");
  EXPECT_EQ(file->OwnerOf(bob_.token), "bob");
}

TEST_F(TokenFileTest, ChangesCountWithoutARestart) {
  ASSERT_TRUE(AddTokenLine(path_, alice_.line).ok());
  const auto file = Open();
  EXPECT_FALSE(file->OwnerOf(bob_.token).has_value());
  ASSERT_TRUE(AddTokenLine(path_, bob_.line).ok());
  EXPECT_TRUE(Soon([&] { return file->OwnerOf(bob_.token).has_value(); }));
  std::ofstream(test_ / "new") << bob_.line;
  std::filesystem::rename(test_ / "new", path_);
  EXPECT_TRUE(Soon([&] { return !file->OwnerOf(alice_.token).has_value(); })) << "revoked";
  EXPECT_EQ(complaints_, 0);
}

TEST_F(TokenFileTest, ABrokenFileChangesNothing) {
  ASSERT_TRUE(AddTokenLine(path_, alice_.line).ok());
  const auto file = Open();
  std::ofstream(path_) << "nonsense";
  EXPECT_TRUE(Soon([&] { return complaints_ == 1; }));
  EXPECT_EQ(file->OwnerOf(alice_.token), "alice");
  std::filesystem::remove(path_);
  EXPECT_TRUE(Soon([&] { return complaints_ == 2; }));
  EXPECT_EQ(file->OwnerOf(alice_.token), "alice");
}

// Nobody is locked out by an editor that empties the file before it writes it anew.
TEST_F(TokenFileTest, AFileThatIsBeingWrittenDoesNotCountYet) {
  ASSERT_TRUE(AddTokenLine(path_, alice_.line).ok());
  const auto file = Open();
  for (int i = 0; i < 15; ++i) {
    std::ofstream out(path_);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(file->OwnerOf(alice_.token), "alice");
    out << alice_.line << "\n";
  }
}

TEST_F(TokenFileTest, AMissingOrWrongFileIsNotOpened) {
  EXPECT_THAT(std::string(TokenFile::Open(path_, {}).status().message()),
              testing::HasSubstr("--make-token"));
  std::ofstream(path_) << "nonsense";
  EXPECT_THAT(std::string(TokenFile::Open(path_, {}).status().message()),
              testing::HasSubstr("line 1"));
}

}  // namespace
}  // namespace rilievo
