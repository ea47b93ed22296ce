// The malformed files that the team shares: each must end at the reader as its README says, or be
// read completely where a later stage has to judge it.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/scans/shared_folder.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

// Points the reader gives; -1: INVALID_ARGUMENT, -2: DATA_LOSS.
const std::map<std::string, int> kExpected = {
    {"empty_file", -1},
    {"zero_vertices", -1},
    {"truncated_binary", -2},
    {"truncated_header", -2},
    {"truncated_ascii", -2},
    {"nan_inf", 400},
    {"all_nan", 50},
    {"one_point", 1},
    {"three_points", 3},
    {"all_identical", 500},
    {"collinear", 500},
    {"coplanar_grid", 1024},
    {"duplicates_x5", 1500},
    {"huge_1e30", 400},
    {"tiny_1e-30", 400},
    {"far_outlier", 401},
    {"utm_float32", 1600},
    {"utm_double", 1600},
    {"claims_4e9_vertices", -2},
    {"claims_2e64_vertices", -1},
    {"negative_vertices", -1},
    {"list_property_vertex", 200},
    {"huge_list_count", -1},
    {"big_endian", 400},
    {"crlf_ascii", 400},
    {"crlf_header_binary", 400},
    {"mixed_props", 400},
    {"no_z", -1},
    {"ascii_garbage", -1},
    {"ascii_spaces", 5},
    {"unknown_format", -1},
    {"unknown_type", -1},
    {"faces_before_vertices", 4},
    {"two_vertex_elements", -1},
    {"long_comment", 400},
    {"random_bytes", -1},
    {"png_named", -1},
    {"no_newline_magic", -1},
    {"two_components", 1200},
    {"moebius", 3000},
    {"uniform_volume", 2000},
};

TEST(SharedBadFilesTest, EachEndsAsItsReadmeSays) {
  const fs::path folder = SharedData() / "bad";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no folder " << folder;
  size_t seen = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".ply") continue;
    SCOPED_TRACE(entry.path().stem().string());
    const auto expected = kExpected.find(entry.path().stem().string());
    if (expected == kExpected.end()) {
      ADD_FAILURE() << "a new file: say in kExpected how it must end at the reader";
      continue;
    }
    ++seen;
    const auto scan = ReadScan(entry.path().string());
    if (expected->second < 0) {
      EXPECT_EQ(scan.status().code(), expected->second == -1 ? absl::StatusCode::kInvalidArgument
                                                             : absl::StatusCode::kDataLoss)
          << scan.status();
    } else {
      ASSERT_TRUE(scan.ok()) << scan.status();
      EXPECT_EQ(scan->cloud.points.cols(), expected->second);
    }
  }
  EXPECT_EQ(seen, kExpected.size());
}

TEST(SharedBadFilesTest, OddLayoutsStillGiveTheUnitSphere) {
  const fs::path folder = SharedData() / "bad";
  if (!fs::is_directory(folder)) GTEST_SKIP() << "no folder " << folder;
  for (const char* name : {"list_property_vertex", "big_endian", "crlf_ascii", "crlf_header_binary",
                           "mixed_props", "long_comment"}) {
    const auto scan = ReadScan((folder / (std::string(name) + ".ply")).string());
    ASSERT_TRUE(scan.ok()) << scan.status();
    const Eigen::RowVectorXd radius = scan->cloud.points.colwise().norm();
    EXPECT_NEAR(radius.minCoeff(), 1, 1e-5) << name;
    EXPECT_NEAR(radius.maxCoeff(), 1, 1e-5) << name;
  }
}

}  // namespace
}  // namespace rilievo
