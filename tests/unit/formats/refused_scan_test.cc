// Scans that are wrong, and what is said of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using testing::FloatRows;
using ::testing::HasSubstr;
using testing::PlyHeaderText;
using testing::Raw;
using testing::ReadBytes;
using testing::SpherePoints;

struct BadScan {
  const char* name;
  std::string bytes;
  absl::StatusCode code;
  std::vector<std::string> message;
};

constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
constexpr auto kLost = absl::StatusCode::kDataLoss;

std::vector<BadScan> BadScans() {
  const std::string rows = FloatRows(SpherePoints(10));
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const auto binary = [&](const std::string& count) {
    return PlyHeaderText("binary_little_endian", count) + rows;
  };
  const auto ascii = [&](const std::string& body, const std::string& count = "4") {
    return PlyHeaderText("ascii", count) + body;
  };
  const std::string pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  return {
      {"empty.ply", "", kInvalid, {"empty"}},
      {"magic.ply", "plyformat ascii 1.0", kInvalid, {"first line"}},
      {"random.ply", std::string(4096, '\x93'), kInvalid, {"first line is not 'ply'"}},
      {"png.ply", "\x89PNG\r\n\x1a\n", kInvalid, {"PNG"}},
      {"short.las", "LASF\x01\x02", kLost, {"LAS", "header"}},
      {"e57.las", "ASTM-E57", kLost, {"E57", "header"}},
      {"header.ply", "ply\nformat ascii 1.0\nelement vertex 10\nprop", kLost, {"end_header"}},
      {"zero.ply", binary("0"), kInvalid, {"count is 0"}},
      {"claims_4e9.ply", binary("4294967295"), kLost, {"vertex", "4294967295", "120 bytes"}},
      {"claims_2e63.ply", binary("9223372036854775807"), kLost, {"vertex", "120 bytes"}},
      {"claims_2e64.ply", binary("18446744073709551616"), kInvalid, {"line 3", "below 2^64"}},
      {"negative.ply", binary("-5"), kInvalid, {"line 3", "'-5'"}},
      {"fraction.ply", binary("1.5"), kInvalid, {"line 3", "'1.5'"}},
      {"short.ply", binary("11"), kLost, {"claims 11", "at most 10"}},
      {"no_z.ply",
       PlyHeaderText("binary_little_endian", "10", "property float x\nproperty float y\n") + rows,
       kInvalid,
       {"no property 'z'"}},
      {"list_z.ply",
       PlyHeaderText("ascii", "1", "property float x\nproperty float y\nproperty list int int z\n"),
       kInvalid,
       {"'z'", "list"}},
      {"two_x.ply", PlyHeaderText("ascii", "1", xyz + "property float x\n"), kInvalid, {"'x'"}},
      {"no_vertex.ply",
       "ply\nformat ascii 1.0\nelement point 3\nend_header\n",
       kInvalid,
       {"no element 'vertex'", "point"}},
      {"two_vertex.ply",
       "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + "element vertex 1\n" + xyz +
           "end_header\n0 0 0\n9 9 9\n",
       kInvalid,
       {"2 elements are called 'vertex'"}},
      {"format.ply",
       PlyHeaderText("binary_middle_endian", "10"),
       kInvalid,
       {"line 2", "binary_middle_endian"}},
      {"no_format.ply",
       "ply\nelement vertex 1\n" + xyz + "end_header\n0 0 0\n",
       kInvalid,
       {"format"}},
      {"type.ply",
       PlyHeaderText("ascii", "1", "property quaternion x\n"),
       kInvalid,
       {"line 4", "quaternion", "double"}},
      {"keyword.ply", "ply\nformat ascii 1.0\nvertices 3\n", kInvalid, {"line 3", "vertices"}},
      {"lone_property.ply", "ply\nformat ascii 1.0\nproperty float x\n", kInvalid, {"line 3"}},
      {"float_count.ply",
       PlyHeaderText("ascii", "1", "property list float int x\n"),
       kInvalid,
       {"integer"}},
      {"huge_list.ply",
       PlyHeaderText("binary_little_endian", "1", xyz + "property list uint float l\n") +
           std::string(12, '\0') + "\xff\xff\xff\xff" + std::string(16, '\0'),
       kInvalid,
       {"'l'", "4294967295"}},
      {"negative_list.ply",
       PlyHeaderText("binary_little_endian", "1", xyz + "property list int float l\n") +
           std::string(12, '\0') + Raw(-3) + std::string(16, '\0'),
       kInvalid,
       {"'l'", "-3"}},
      {"word.ply",
       ascii("0 0 0\n1 abc 0\n0 1 0\n0 0 1\n"),
       kInvalid,
       {"line 9", "property 'y'", "'abc'"}},
      {"decimal_comma.ply",
       ascii("0 0 0\n0,5 1,25 0\n0 1 0\n0 0 1\n"),
       kInvalid,
       {"line 9", "'0,5'", "0.5"}},
      {"overflow.ply",
       ascii("1e400 0 0\n0 0 0\n0 1 0\n0 0 1\n"),
       kInvalid,
       {"line 8", "1e400", "double"}},
      {"few_values.ply", ascii("0 0 0\n1 0\n0 1 0\n0 0 1.5\n"), kInvalid, {"line 9", "too few"}},
      {"many_values.ply",
       ascii("0 0 0\n1 0 0 7\n0 1 0\n0 0 1\n"),
       kInvalid,
       {"line 9", "more values", "'7'"}},
      {"few_lines.ply", ascii("0 0 0\n1 0.123456789 0.5\n"), kLost, {"claims 4", "number 3"}},
      {"ascii_claim.ply", ascii("0 0 0\n1 0 0\n", "4000000000"), kLost, {"4000000000"}},
      {"ascii_list.ply",
       PlyHeaderText("ascii", "1", xyz + "property list int int l\n") + "0 0 0 4000000000 1\n",
       kInvalid,
       {"too few"}},
      {"faces.ply",
       "ply\nformat binary_little_endian 1.0\nelement face 4000000000\nproperty list uchar int i\n"
       "element vertex 1\n" +
           xyz + "end_header\n" + std::string(40, '\0'),
       kLost,
       {"'face'", "4000000000"}},
      {"field.pcd",
       "VERSION 0.7\nFIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n0 0\n",
       kInvalid,
       {"'z'"}},
      {"size.pcd",
       "VERSION 0.7\nFIELDS x y z\nSIZE 4 3 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n",
       kInvalid,
       {"'y'", "SIZE '3'"}},
      {"types.pcd",
       "VERSION 0.7\nFIELDS x y z\nSIZE 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n",
       kInvalid,
       {"3 values"}},
      {"data.pcd", pcd + "POINTS 1\nDATA zip\n", kInvalid, {"'zip'", "binary_compressed"}},
      {"points.pcd", pcd + "WIDTH 2\nHEIGHT 2\nPOINTS 3\nDATA ascii\n", kInvalid, {"WIDTH"}},
      {"overflow.pcd",
       pcd + "WIDTH 9223372036854775808\nHEIGHT 4\nDATA binary\n",
       kInvalid,
       {"overflow"}},
      {"claim.pcd", pcd + "POINTS 4000000000\nDATA binary\n" + rows, kLost, {"4000000000", "120"}},
      {"ascii_claim.pcd", pcd + "POINTS 4000000000\nDATA ascii\n0 0 0\n", kLost, {"4000000000"}},
      {"word.pcd", pcd + "POINTS 2\nDATA ascii\n0 0 0\n0 x 0\n", kInvalid, {"line 8", "'x'"}},
      {"columns.pcd",
       pcd + "POINTS 2\nDATA ascii\n0 0 0\n0 0 0 0\n",
       kInvalid,
       {"line 8", "4 values"}},
      {"no_data.pcd", pcd + "POINTS 2\n", kLost, {"DATA"}},
      {"bomb.pcd",
       pcd + "POINTS 300000000\nDATA binary_compressed\n" + Raw(4u) + Raw(3600000000u) + "abcd",
       kLost,
       {"cannot hold"}},
      {"plane.pcd",
       pcd + "POINTS 3\nDATA binary_compressed\n" + Raw(4u) + Raw(35u) + "abcd",
       kInvalid,
       {"35"}},
      {"reference.pcd",
       pcd + "POINTS 1\nDATA binary_compressed\n" + Raw(3u) + Raw(12u) + "\x20\x05\x01",
       kLost,
       {"before the start"}},
      {"none.xyz", "# nothing\n\n", kInvalid, {"none"}},
      {"two.xyz", "1 2 3\n1 2\n", kInvalid, {"line 2", "2 values"}},
      {"word.xyz", "1 2 3\n1 b 3\n", kInvalid, {"line 2", "'b'"}},
      {"overflow.xyz", "1 2 3\n1 1e999 3\n", kInvalid, {"line 2", "1e999"}},
      {"comma_blank.xyz", "1.5 2 3\n0,5 1,25 0\n", kInvalid, {"line 2", "decimal comma"}},
      {"comma_semicolon.csv", "0,5;1,25;0,75\n", kInvalid, {"line 1", "decimal comma"}},
      {"comma_last.xyz", "1 2 0,5\n", kInvalid, {"line 1", "decimal comma"}},
      {"heading.csv", "a,b,c\n1,2,3\n", kInvalid, {"line 1", "heading"}},
      {"binary.xyz", std::string("\x01\x02\0\x03zzz\n", 8), kInvalid, {"line 1", "binary"}},
      {"claim.pts", "4000000000\n0 0 0\n", kLost, {"line 1", "4000000000"}},
      {"short.pts", "3\n0.125 0.125 0.125\n0 0 0\n", kLost, {"1 fewer"}},
      {"long.pts", "1\n0 0 0\n0 0 0\n", kInvalid, {"line 3", "more points"}},
      {"two.obj", "v 1 2 3\nv 1 2\n", kInvalid, {"line 2", "2 coordinates"}},
      {"word.obj", "v 1 2 3\nv 1 2 z\n", kInvalid, {"line 2", "'z'"}},
      {"none.obj", "vn 0 0 1\nf 1 2 3\n", kInvalid, {"no 'v' line"}},
      {"noise.obj", std::string("v 1 2 3\n\0\0\n", 11), kInvalid, {"binary"}},
      {"mystery", "hello world\n", kInvalid, {"neither content nor extension"}},
      {"surface",
       "\x89"
       "DSS\r\n\x1a\n",
       kInvalid,
       {".dss"}},
      {"named.dss", "xyz", kInvalid, {".dss"}},
  };
}

class BadScanTest : public ::testing::TestWithParam<BadScan> {};

TEST_P(BadScanTest, IsRefusedWithPlaceAndReason) {
  const auto scan = ReadBytes(GetParam().bytes, GetParam().name);
  ASSERT_FALSE(scan.ok()) << scan->cloud.points.cols();
  EXPECT_EQ(scan.status().code(), GetParam().code) << scan.status();
  for (const std::string& part : GetParam().message) {
    EXPECT_THAT(std::string(scan.status().message()), HasSubstr(part));
  }
}

INSTANTIATE_TEST_SUITE_P(All, BadScanTest, ::testing::ValuesIn(BadScans()), [](const auto& param) {
  std::string name = param.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
});

}  // namespace
}  // namespace rilievo
