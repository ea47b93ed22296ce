#include "server/store/disk_room.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

constexpr uintmax_t kMostBytes = 4 << 20, kLeastBytes = 64 << 10;

// A disk without room for another file of the reserve's size, while it lives.
class FullDisk {
 public:
  FullDisk() {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit none{kLeastBytes - 1, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

class DiskRoomTest : public testing::Test {
 protected:
  uintmax_t ReservedBytes() const {
    std::error_code missing;
    const uintmax_t bytes = std::filesystem::file_size(test_ / "reserve", missing);
    return missing ? 0 : bytes;
  }

  int Files() const {
    return static_cast<int>(std::distance(std::filesystem::directory_iterator(test_.path()), {}));
  }

  TestFolder test_;
};

TEST_F(DiskRoomTest, TakesRoomThatStaysTaken) {
  {
    DiskRoom room(test_.path());
    EXPECT_FALSE(room.full());
    EXPECT_TRUE(room.Check().ok());
  }
  const uintmax_t bytes = ReservedBytes();
  EXPECT_GE(bytes, kLeastBytes);
  EXPECT_LE(bytes, kMostBytes);
  DiskRoom again(test_.path());
  EXPECT_FALSE(again.full());
  EXPECT_EQ(ReservedBytes(), bytes) << "that of the server before";
  EXPECT_EQ(Files(), 1);
}

TEST_F(DiskRoomTest, AWriteThatFoundNoRoomIsFollowedByOthersOnceThereIsRoom) {
  DiskRoom room(test_.path());
  room.Note(absl::OkStatus());
  room.Note(absl::UnavailableError("another program holds it"));
  EXPECT_FALSE(room.full()) << "which says nothing of the room";
  room.Note(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_TRUE(room.full());
  {
    const FullDisk full;
    for (int i = 0; i < 2; ++i) {
      const absl::Status refused = room.Check();
      EXPECT_TRUE(absl::IsResourceExhausted(refused)) << refused;
      EXPECT_TRUE(room.full());
      EXPECT_EQ(Files(), 1) << "nothing half-made";
    }
  }
  EXPECT_TRUE(room.Check().ok());
  EXPECT_FALSE(room.full());
}

TEST_F(DiskRoomTest, ADeletionGetsTheRoomAndTheNextWriteTakesItBack) {
  DiskRoom room(test_.path());
  room.Release();
  EXPECT_EQ(ReservedBytes(), 0u);
  EXPECT_TRUE(room.full());
  {
    const FullDisk full;
    EXPECT_TRUE(absl::IsResourceExhausted(room.Check()));
  }
  EXPECT_TRUE(room.Check().ok());
  EXPECT_FALSE(room.full());
  EXPECT_GE(ReservedBytes(), kLeastBytes);
}

TEST_F(DiskRoomTest, AServerStartsOnAFullDisk) {
  std::unique_ptr<DiskRoom> room;
  {
    const FullDisk full;
    room = std::make_unique<DiskRoom>(test_.path());
    EXPECT_TRUE(room->full());
  }
  EXPECT_TRUE(room->Check().ok());
  EXPECT_GE(ReservedBytes(), kLeastBytes);
}

}  // namespace
}  // namespace rilievo
