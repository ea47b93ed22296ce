#include "server/os/private_files.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

#include "core/base/sanitized.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

int ModeOf(const std::string& path) {
  struct stat status {};
  return stat(path.c_str(), &status) == 0 ? static_cast<int>(status.st_mode & 0777) : -1;
}

TEST(PrivateFiles, ASecretIsItsOwnersAndReplacesNothing) {
  const TestFolder folder;
  const mode_t before = umask(0);
  EXPECT_TRUE(WriteSecret(folder / "token", "secret\n").ok());
  umask(before);
  EXPECT_EQ(ModeOf(folder / "token"), 0600);
  EXPECT_EQ(WriteSecret(folder / "token", "other").code(), absl::StatusCode::kAlreadyExists);
  std::ifstream file(folder / "token");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "secret\n");
  EXPECT_FALSE(WriteSecret(folder / "no/folder", "secret").ok());
}

TEST(PrivateFiles, WhatOthersMayReadIsNoticed) {
  const TestFolder folder;
  ASSERT_TRUE(WriteSecret(folder / "key", "secret").ok());
  for (const auto& [mode, open] : {std::pair(0600, false), std::pair(0640, false),
                                   std::pair(0644, true), std::pair(0602, true)}) {
    ASSERT_EQ(chmod((folder / "key").c_str(), static_cast<mode_t>(mode)), 0);
    EXPECT_EQ(IsOpenToOthers(folder / "key"), open) << std::oct << mode;
  }
  EXPECT_FALSE(IsOpenToOthers(folder / "none"));
}

TEST(PrivateFiles, AProcessThatKeepsToItsUserMakesFilesForNobodyElse) {
  const TestFolder folder;
  const std::string path = folder / "made";
  const pid_t child = fork();
  if (child == 0) {
    KeepToThisUser();
    std::ofstream(path) << "text";
    _exit(kSanitized ? 0 : prctl(PR_GET_DUMPABLE));
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(ModeOf(path), 0600);
}

}  // namespace
}  // namespace rilievo
