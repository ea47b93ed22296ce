// Scans cut off anywhere, and with any byte changed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using testing::NamedBytes;
using testing::ReadBytes;
using testing::SpherePoints;
using testing::ValidScans;

// What a cut file may give: an error, or, where the format has no count (or the cut fell into what
// follows the points), the points so far. The last number of a text may be cut in the middle.
void ExpectErrorOrPrefix(const absl::StatusOr<ScanFile>& scan, size_t length) {
  if (!scan.ok()) {
    EXPECT_TRUE(scan.status().code() == absl::StatusCode::kDataLoss ||
                scan.status().code() == absl::StatusCode::kInvalidArgument)
        << scan.status();
    EXPECT_FALSE(scan.status().message().empty());
    return;
  }
  const Eigen::Matrix3Xd& points = scan->cloud.points;
  const Eigen::Matrix3Xd whole = SpherePoints(40);
  ASSERT_LE(points.cols(), 40) << length;
  EXPECT_TRUE(points.leftCols(points.cols() - 1) == whole.leftCols(points.cols() - 1)) << length;
  EXPECT_TRUE(points.col(points.cols() - 1).head<2>() == whole.col(points.cols() - 1).head<2>());
}

TEST(TruncatedScanTest, EveryPrefixOfEveryFormatEndsCleanly) {
  for (const NamedBytes& scan : ValidScans(40)) {
    SCOPED_TRACE(scan.name);
    if (scan.name == "long_comment.ply") continue;
    for (size_t length = 0; length < scan.bytes.size(); ++length) {
      // The prefix lies in memory of exactly its size, so that ASan sees any byte read past it.
      const std::vector<char> exact(scan.bytes.begin(), scan.bytes.begin() + length);
      ExpectErrorOrPrefix(ReadBytes(std::string(exact.begin(), exact.end()), scan.name), length);
    }
  }
}

TEST(TruncatedScanTest, CountedFormatsNeverAcceptACutBody) {
  for (const NamedBytes& scan : ValidScans(40)) {
    const bool counted = scan.name == "little.ply" || scan.name == "big.ply" ||
                         scan.name == "lists.ply" || scan.name == "binary.pcd" ||
                         scan.name == "compressed.pcd" || scan.name == "crlf_header.ply" ||
                         scan.name.ends_with(".las") || scan.name.ends_with(".e57");
    if (!counted) continue;
    for (size_t length = 0; length < scan.bytes.size(); ++length) {
      EXPECT_FALSE(ReadBytes(scan.bytes.substr(0, length), scan.name).ok()) << scan.name << length;
    }
  }
}

TEST(DamagedScanTest, AnyByteChangedEndsCleanly) {
  for (const NamedBytes& scan : ValidScans(8)) {
    if (scan.name == "long_comment.ply") continue;
    for (size_t at = 0; at < scan.bytes.size(); ++at) {
      for (int change : {0x00, 0xff, 0x80, 0x0a, 0x39}) {
        std::string bytes = scan.bytes;
        bytes[at] = static_cast<char>(change);
        const auto result = ReadBytes(bytes, scan.name);
        if (result.ok()) {
          EXPECT_LE(result->cloud.points.cols(), 100000) << scan.name;
        } else {
          EXPECT_FALSE(result.status().message().empty());
        }
      }
    }
  }
}

}  // namespace
}  // namespace rilievo
