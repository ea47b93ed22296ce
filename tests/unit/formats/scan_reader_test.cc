#include "client/formats/scan_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using rilievo::testing::FloatRows;
using rilievo::testing::NamedBytes;
using rilievo::testing::PlyHeaderText;
using rilievo::testing::Raw;
using rilievo::testing::SpherePoints;
using rilievo::testing::TextRows;
using rilievo::testing::ValidScans;
using ::testing::HasSubstr;

absl::StatusOr<ScanFile> Read(const std::string& bytes, const std::string& name) {
  std::istringstream in(bytes);
  return ReadScanStream(in, name);
}

// A stream that cannot seek, as a pipe.
class PipeBuffer : public std::stringbuf {
 public:
  explicit PipeBuffer(const std::string& bytes) : std::stringbuf(bytes, std::ios::in) {}

 protected:
  pos_type seekoff(off_type, std::ios::seekdir, std::ios::openmode) override {
    return pos_type(off_type(-1));
  }
};

class ValidScanTest : public ::testing::TestWithParam<NamedBytes> {};

TEST_P(ValidScanTest, GivesEachPointExactly) {
  const auto scan = Read(GetParam().bytes, GetParam().name);
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->cloud.points.cols(), GetParam().points);
  EXPECT_TRUE(scan->cloud.points == SpherePoints(GetParam().points));
}

TEST_P(ValidScanTest, ReadsFromAPipe) {
  PipeBuffer buffer(GetParam().bytes);
  std::istream in(&buffer);
  const auto scan = ReadScanStream(in, GetParam().name);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points == SpherePoints(GetParam().points));
}

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
      ExpectErrorOrPrefix(Read(std::string(exact.begin(), exact.end()), scan.name), length);
    }
  }
}

TEST(TruncatedScanTest, CountedFormatsNeverAcceptACutBody) {
  for (const NamedBytes& scan : ValidScans(40)) {
    const bool counted = scan.name == "little.ply" || scan.name == "big.ply" ||
                         scan.name == "lists.ply" || scan.name == "binary.pcd" ||
                         scan.name == "compressed.pcd" || scan.name == "crlf_header.ply" ||
                         scan.name.ends_with(".las");
    if (!counted) continue;
    for (size_t length = 0; length < scan.bytes.size(); ++length) {
      EXPECT_FALSE(Read(scan.bytes.substr(0, length), scan.name).ok()) << scan.name << length;
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
        const auto result = Read(bytes, scan.name);
        if (result.ok()) {
          EXPECT_LE(result->cloud.points.cols(), 100000) << scan.name;
        } else {
          EXPECT_FALSE(result.status().message().empty());
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ValidScanTest, ::testing::ValuesIn(ValidScans(333)),
                         [](const auto& param) {
                           std::string name = param.param.name;
                           for (char& c : name)
                             c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

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
      {"e57.las", "ASTM-E57", kInvalid, {"E57", "pdal"}},
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
  const auto scan = Read(GetParam().bytes, GetParam().name);
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

TEST(ScanReaderTest, MapGridOffsetsKeepEveryBitOfDouble) {
  Eigen::Matrix3Xd points(3, 2);
  points << 500000.123456789, 4.6e6 + 1e-9, 4600000.000000001, 1.0 / 3, 1e-310, 1e300;
  const std::string rows = TextRows(points);
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.ply", PlyHeaderText("ascii", "2",
                                   "property double x\nproperty double y\nproperty double z\n") +
                         rows},
           {"a.xyz", rows},
           {"a.pcd",
            "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS 2\nDATA ascii\n" + rows}}) {
    const auto scan = Read(bytes, name);
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->cloud.points == points) << name;
  }
}

TEST(ScanReaderTest, EveryScalarTypeOfPly) {
  const std::vector<std::pair<std::string, std::string>> types = {
      {"char", Raw(int8_t{-7})},
      {"int8", Raw(int8_t{-7})},
      {"uchar", Raw(uint8_t{249})},
      {"uint8", Raw(uint8_t{249})},
      {"short", Raw(int16_t{-7})},
      {"int16", Raw(int16_t{-7})},
      {"ushort", Raw(uint16_t{65529})},
      {"uint16", Raw(uint16_t{65529})},
      {"int", Raw(int32_t{-7})},
      {"int32", Raw(int32_t{-7})},
      {"uint", Raw(4294967289u)},
      {"uint32", Raw(4294967289u)},
      {"int64", Raw(int64_t{-7})},
      {"uint64", Raw(uint64_t{9007199254740992})},
      {"float", Raw(-7.0f)},
      {"float32", Raw(-7.0f)},
      {"double", Raw(-7.0)},
      {"float64", Raw(-7.0)}};
  const auto value = [](const std::string& type, size_t size) -> double {
    if (type == "uint64") return 9007199254740992.0;
    if (type[0] == 'u') return std::pow(2.0, 8.0 * static_cast<double>(size)) - 7;
    return -7;
  };
  for (const auto& [type, raw] : types) {
    const std::string properties =
        "property " + type + " z\nproperty double x\nproperty " + type + " y\n";
    const auto scan = Read(
        PlyHeaderText("binary_little_endian", "1", properties) + raw + Raw(0.25) + raw, "a.ply");
    ASSERT_TRUE(scan.ok()) << type << scan.status();
    EXPECT_EQ(scan->cloud.points(0, 0), 0.25);
    EXPECT_EQ(scan->cloud.points(1, 0), value(type, raw.size())) << type;
    EXPECT_EQ(scan->cloud.points(2, 0), value(type, raw.size())) << type;
  }
}

TEST(ScanReaderTest, NonFinitePointsAreKeptForTheCheck) {
  const auto text = Read("0 0 0\nnan 1 2\n-inf inf 1\n", "a.xyz");
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_TRUE(std::isnan(text->cloud.points(0, 1)));
  EXPECT_EQ(text->cloud.points(0, 2), -std::numeric_limits<double>::infinity());
}

TEST(ScanReaderTest, ColumnsAreTakenByTheNamesOfTheHeading) {
  const auto scan = Read("time;Z;Y;X;name\n9;3;2;1;a\n9;6;5;4;b\n", "a.csv");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(1) == Eigen::Vector3d(4, 5, 6));
}

TEST(ScanReaderTest, SeveralCountedBlocks) {
  const auto scan = Read("2\n0 0 0 1\n1 1 1 1\n1\n2 2 2 1\n", "a.pts");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(2) == Eigen::Vector3d(2, 2, 2));
}

TEST(ScanReaderTest, ContinuedLinesOfObjAreJoined) {
  const auto scan = Read("v 1 \\\n2 3\nv 4 5 6\n", "a.obj");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(0) == Eigen::Vector3d(1, 2, 3));
}

TEST(ScanReaderTest, ContentGoesBeforeExtension) {
  const std::string ply = PlyHeaderText("binary_little_endian", "10") + FloatRows(SpherePoints(10));
  EXPECT_EQ(Read(ply, "a.xyz")->format, "PLY binary_little_endian");
  EXPECT_EQ(Read(ply, "noextension")->format, "PLY binary_little_endian");
}

TEST(ScanReaderTest, AClaimBeforeAPipeAllocatesNothing) {
  PipeBuffer buffer(PlyHeaderText("binary_little_endian", "4000000000") +
                    FloatRows(SpherePoints(10)));
  std::istream in(&buffer);
  const auto scan = ReadPlyScan(in);
  EXPECT_EQ(scan.status().code(), kLost) << scan.status();
}

TEST(ScanReaderTest, ErrorsOfFilesBeginWithThePath) {
  const auto missing = ReadScan("/nonexistent/scan.ply");
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("/nonexistent/scan.ply"));
  const auto folder = ReadScan("/");
  EXPECT_EQ(folder.status().code(), kInvalid);
  EXPECT_THAT(std::string(folder.status().message()), HasSubstr("folder"));
}

}  // namespace
}  // namespace rilievo
