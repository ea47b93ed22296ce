#include "client/formats/unpacked_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tests/unit/formats/packed_bytes.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using ::testing::AllOf;
using testing::Gzip;
using ::testing::HasSubstr;
using testing::NamedBytes;
using testing::ValidScans;
using testing::Zstd;

struct Packer {
  const char *name, *extension;
  std::string (*pack)(const std::string&);
};
constexpr Packer kPackers[] = {{"gzip", ".gz", Gzip}, {"zstd", ".zst", Zstd}};

absl::StatusOr<ScanFile> ReadPacked(const std::string& packed, const std::string& name) {
  std::istringstream in(packed);
  return WithUnpacked(in, [&](std::istream& held) { return ReadScanStream(held, name); });
}

absl::StatusOr<std::string> Unpack(const std::string& packed) {
  std::istringstream in(packed);
  return WithUnpacked(in, [](std::istream& held) -> absl::StatusOr<std::string> {
    return std::string{std::istreambuf_iterator<char>(held), std::istreambuf_iterator<char>()};
  });
}

// Neither all alike nor beyond compression, and larger than the blocks that are read and written.
std::string ManyBytes() {
  std::string bytes;
  uint32_t state = 1;
  while (bytes.size() < 2'000'000) {
    state = state * 1664525 + 1013904223;
    bytes += std::to_string(state >> 12) + (state >> 31 ? " " : "\n");
  }
  return bytes;
}

TEST(UnpackedInputTest, EveryFormatIsReadAsItIsWithoutCompression) {
  for (const Packer& packer : kPackers) {
    for (const NamedBytes& scan : ValidScans(40)) {
      SCOPED_TRACE(scan.name + packer.extension);
      const auto plain = testing::ReadBytes(scan.bytes, scan.name);
      const auto packed = ReadPacked(packer.pack(scan.bytes), scan.name + packer.extension);
      ASSERT_TRUE(plain.ok() && packed.ok()) << packed.status();
      EXPECT_EQ(packed->format, plain->format);
      EXPECT_EQ(packed->cloud.points, plain->cloud.points);
    }
  }
}

TEST(UnpackedInputTest, MembersAndFramesFollowOneAnother) {
  const std::string first = ManyBytes(), second = "and this\n";
  for (const Packer& packer : kPackers) {
    const auto both = Unpack(packer.pack(first) + packer.pack("") + packer.pack(second));
    ASSERT_TRUE(both.ok()) << both.status();
    EXPECT_EQ(*both, first + second) << packer.name;
  }
}

TEST(UnpackedInputTest, NoPrefixIsTakenForTheWhole) {
  const std::string text = "0 0 0\n1 0 0\n0 1 0\n1 1 1\n";
  for (const Packer& packer : kPackers) {
    const std::string packed = packer.pack(text);
    for (size_t length = 4; length < packed.size(); ++length) {
      const auto scan = ReadPacked(packed.substr(0, length), "scan.xyz");
      EXPECT_EQ(scan.status().code(), absl::StatusCode::kDataLoss) << scan.status();
      EXPECT_THAT(scan.status().message(), AllOf(HasSubstr(packer.name), HasSubstr("truncated")));
    }
  }
}

TEST(UnpackedInputTest, AChangedByteNeverChangesThePoints) {
  const std::string text = "0 0 0\n1 0 0\n0 1 0\n1 1 1\n";
  for (const Packer& packer : kPackers) {
    const std::string packed = packer.pack(text);
    int refused = 0;
    for (size_t at = 0; at < packed.size(); ++at) {
      for (const int change : {0x01, 0x10, 0x80}) {
        std::string damaged = packed;
        damaged[at] = static_cast<char>(damaged[at] ^ change);
        const auto held = Unpack(damaged);
        if (!held.ok()) {
          EXPECT_THAT(held.status().message(), HasSubstr(packer.name));
          ++refused;
        } else if (PackingOf(damaged)) {
          EXPECT_EQ(*held, text) << at;
        }
      }
    }
    EXPECT_GT(refused, 60) << packer.name;
  }
}

TEST(UnpackedInputTest, WhatFollowsTheEndIsRefused) {
  for (const Packer& packer : kPackers) {
    const auto held = Unpack(packer.pack("0 0 0\n") + "rest of something else");
    EXPECT_EQ(held.status().code(), absl::StatusCode::kDataLoss) << packer.name;
  }
}

// A reader that has what it wants does not look at the end; its checksum is looked at all the same.
TEST(UnpackedInputTest, DamageBehindThePointsIsNoticed) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n1 2 3\n";
  for (const Packer& packer : kPackers) {
    std::string packed = packer.pack(ply + ManyBytes());
    EXPECT_TRUE(ReadPacked(packed, "scan.ply").ok());
    packed[packed.size() - 2] ^= 1;
    EXPECT_EQ(ReadPacked(packed, "scan.ply").status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST(UnpackedInputTest, ABombIsRefusedAtTheLimit) {
  const std::string zeros(size_t{80} << 20, '\0');
  for (const Packer& packer : kPackers) {
    const std::string bomb = packer.pack(zeros);
    const uint64_t most = (uint64_t{64} << 20) + 100 * bomb.size();
    ASSERT_LT(most, zeros.size());
    const auto held = Unpack(bomb);
    EXPECT_EQ(held.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(held.status().message(),
                AllOf(HasSubstr(std::to_string(most)), HasSubstr("unpack it first")));
  }
}

TEST(UnpackedInputTest, TheLimitIsThatOfTheFile) {
  const std::string bytes = ManyBytes();
  for (const Packer& packer : kPackers) {
    const std::string packed = packer.pack(bytes);
    for (const bool enough : {true, false}) {
      std::istringstream in(packed);
      const Packing packing = *PackingOf(packed);
      UnpackedInput input(
          in, packing, packed.size(),
          {.any_file = bytes.size() - packed.size() - (enough ? 0 : 1), .per_byte = 1});
      EXPECT_EQ(input.Finish().ok(), enough) << input.status();
    }
  }
}

TEST(UnpackedInputTest, TwiceIsOnceTooOften) {
  for (const Packer& packer : kPackers) {
    const auto scan = ReadPacked(packer.pack(packer.pack("0 0 0\n")), "scan.xyz");
    EXPECT_THAT(scan.status().message(),
                HasSubstr(std::string(packer.name) + "-compressed; unpack it first"));
  }
}

TEST(UnpackedInputTest, TheNameOfWhatIsHeld) {
  EXPECT_EQ(NameUnpacked("a/scan.xyz.gz"), "a/scan.xyz");
  EXPECT_EQ(NameUnpacked("scan.PLY.ZST"), "scan.PLY");
  EXPECT_EQ(NameUnpacked("scan.ply"), "scan.ply");
}

}  // namespace
}  // namespace rilievo
