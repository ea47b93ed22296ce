#include "server/store/blob_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "server/store/content_name.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

TEST(BlobFolder, WhatWasNotFinishedIsRemoved) {
  const TestFolder test;
  const std::string whole = test / "blobs/" + ContentNameOf("x");
  std::filesystem::create_directory(test / "blobs");
  std::ofstream(test / "blobs/new-3") << "half";
  std::ofstream(whole) << "x";
  const auto blobs = BlobFolder::Open(test / "blobs");
  ASSERT_TRUE(blobs.ok());
  EXPECT_FALSE(std::filesystem::exists(test / "blobs/new-3"));
  EXPECT_TRUE(std::filesystem::exists(whole));
}

TEST(BlobFolder, WhatOthersAreAtStays) {
  const TestFolder test;
  std::filesystem::create_directory(test / "blobs");
  std::ofstream(test / "blobs/new-3") << "half";
  ASSERT_TRUE(BlobFolder::Open(test / "blobs", BlobFolder::Users::kMany).ok());
  EXPECT_TRUE(std::filesystem::exists(test / "blobs/new-3"));
  std::filesystem::last_write_time(
      test / "blobs/new-3", std::filesystem::file_time_type::clock::now() - std::chrono::hours(25));
  ASSERT_TRUE(BlobFolder::Open(test / "blobs", BlobFolder::Users::kMany).ok());
  EXPECT_FALSE(std::filesystem::exists(test / "blobs/new-3")) << "nobody is at it for a day";
}

TEST(BlobFolder, OnlyBlobsAreTakenOutOfTheWay) {
  const TestFolder test;
  const auto blobs = BlobFolder::Open(test / "blobs");
  const std::string one = *blobs->Put({{1}}), two = *blobs->Put({{2}});
  std::ofstream(test / "jobs.db") << "x";
  for (const char* name : {"", ".", "..", "../jobs.db"}) {
    EXPECT_TRUE(blobs->SetAside(name).ok()) << name;
    EXPECT_TRUE(blobs->Remove(name).ok()) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(test / "damaged"));
  EXPECT_TRUE(std::filesystem::exists(test / "jobs.db"));
  EXPECT_TRUE(blobs->BytesOf(one).ok() && blobs->BytesOf(two).ok());
  EXPECT_TRUE(blobs->SetAside(one).ok());
  EXPECT_TRUE(std::filesystem::exists(test / "damaged/" + one));
  EXPECT_TRUE(blobs->BytesOf(two).ok());
}

// A full disk is played by the largest size of a file.
TEST(BlobFolder, AFullDiskLeavesNothingBehind) {
  const TestFolder test;
  const auto blobs = BlobFolder::Open(test / "blobs");
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{100'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const auto refused = blobs->Put({std::vector<uint8_t>(200'000, 7)});
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted) << refused.status();
  EXPECT_TRUE(std::filesystem::is_empty(test / "blobs"));
  EXPECT_TRUE(blobs->Put({std::vector<uint8_t>(200'000, 7)}).ok());
}

}  // namespace
}  // namespace rilievo
