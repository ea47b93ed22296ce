// E57 files of a formula's points, in all the ways that fields can be stored, and damaged ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <istream>
#include <limits>
#include <sstream>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/scan_reader.h"
#include "tests/unit/formats/e57_file.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo::testing {
namespace {

using ::testing::HasSubstr;

constexpr int kCount = 500;

// Whole numbers from -2000 to 2000.
std::vector<int64_t> Formula(int axis, int count = kCount) {
  std::vector<int64_t> values;
  for (int i = 0; i < count; ++i) values.push_back((i * (37 + 100 * axis) + axis) % 4001 - 2000);
  return values;
}

std::vector<double> Reals(const std::vector<int64_t>& values, double scale = 1, double offset = 0) {
  std::vector<double> reals;
  for (const int64_t value : values) {
    reals.push_back(static_cast<double>(value) * scale + offset);
  }
  return reals;
}

const char* const kPlaceNames[] = {"cartesianX", "cartesianY", "cartesianZ"};

E57Scan RealScan(bool single, int count = kCount) {
  E57Scan scan = {.records = static_cast<uint64_t>(count)};
  for (int axis = 0; axis < 3; ++axis) {
    scan.columns.push_back(E57Reals(kPlaceNames[axis], single, Reals(Formula(axis, count), .125)));
  }
  return scan;
}

absl::StatusOr<ScanFile> Read(const std::string& bytes) {
  std::istringstream in(bytes);
  return ReadScanStream(in, "-", {.intensity = true, .colors = true});
}

void ExpectFormula(const absl::StatusOr<ScanFile>& scan, double scale, double offset = 0) {
  ASSERT_TRUE(scan.ok()) << scan.status();
  ASSERT_EQ(scan->cloud.points.cols(), kCount);
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> expected = Reals(Formula(axis), scale, offset);
    for (int i = 0; i < kCount; ++i) {
      ASSERT_EQ(scan->cloud.points(axis, i), expected[static_cast<size_t>(i)]) << axis << " " << i;
    }
  }
}

TEST(E57ReaderTest, ReadsRealsOfBothPrecisions) {
  for (const bool single : {false, true}) ExpectFormula(Read(E57File({RealScan(single)})), .125);
  EXPECT_EQ(Read(E57File({RealScan(true)}))->format, "E57 1.0, 1 scan");
}

TEST(E57ReaderTest, ReadsPagesOfOtherSizes) {
  for (const size_t page : {64, 128, 4096}) {
    ExpectFormula(Read(E57File({RealScan(false)}, page)), .125);
  }
}

// Integers of `bits` bits: the least that hold the formula, widths that cross bytes and words, all.
class E57IntegerTest : public ::testing::TestWithParam<int> {};

TEST_P(E57IntegerTest, ValuesOfAnyWidthGoOnFromPacketToPacket) {
  const int64_t minimum = GetParam() == 64 ? std::numeric_limits<int64_t>::min() : -2000;
  const int64_t maximum =
      static_cast<int64_t>(static_cast<uint64_t>(minimum) + (~uint64_t{0} >> (64 - GetParam())));
  E57Scan scan = {.records = kCount, .pieces = {7, 11, 5}, .other_packets = true};
  E57Scan scaled = {.records = kCount, .pieces = {64, 0, 3}};
  for (int axis = 0; axis < 3; ++axis) {
    scan.columns.push_back(E57Integers(kPlaceNames[axis], minimum, maximum, Formula(axis)));
    scaled.columns.push_back(E57Integers(kPlaceNames[axis], minimum, maximum, Formula(axis),
                                         "scale=\"0.001\" offset=\"1000\""));
  }
  ExpectFormula(Read(E57File({scan})), 1);
  ExpectFormula(Read(E57File({scaled})), .001, 1000);
}

INSTANTIATE_TEST_SUITE_P(Bits, E57IntegerTest,
                         ::testing::Values(12, 13, 16, 19, 24, 31, 32, 33, 47, 57, 58, 61, 63, 64));

TEST(E57ReaderTest, FieldsWithOneValueTakeNoBits) {
  E57Scan scan = RealScan(false);
  scan.columns[2] = E57Integers("cartesianZ", -7, -7, std::vector<int64_t>(kCount, -7),
                                "scale=\"0.5\" offset=\"1\"");
  EXPECT_TRUE(scan.columns[2].stream.empty());
  const auto read = Read(E57File({scan}));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->cloud.points.cols(), kCount);
  EXPECT_TRUE((read->cloud.points.row(2).array() == -2.5).all());
}

TEST(E57ReaderTest, PacketsMayStartAnewBetweenValues) {
  E57Scan scan = RealScan(false);
  scan.pieces = {80, 80, 80};
  scan.restarts = true;
  ExpectFormula(Read(E57File({scan})), .125);
}

TEST(E57ReaderTest, InvalidPointsAreLeftOut) {
  E57Scan scan = RealScan(false, 6);
  scan.columns.insert(scan.columns.begin(),
                      E57Integers("cartesianInvalidState", 0, 2, {0, 1, 2, 0, 0, 2}));
  const auto read = Read(E57File({scan}));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->cloud.points.cols(), 3);
  EXPECT_EQ(read->cloud.points(0, 1), .125 * static_cast<double>(Formula(0)[3]));
  EXPECT_EQ(read->format, "E57 1.0, 1 scan, without 3 invalid points");
}

TEST(E57ReaderTest, SphericalPlacesBecomeCartesian) {
  std::vector<double> range, azimuth, elevation;
  for (int i = 0; i < 50; ++i) {
    range.push_back(1 + i % 5);
    azimuth.push_back(.25 * i - 6);
    elevation.push_back(.0625 * i - 1.5);
  }
  E57Scan scan = {.columns = {E57Reals("sphericalAzimuth", false, azimuth),
                              E57Reals("sphericalElevation", false, elevation),
                              E57Reals("sphericalRange", false, range),
                              E57Integers("sphericalInvalidState", 0, 0, {})},
                  .records = 50};
  const auto read = Read(E57File({scan}));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->cloud.points.cols(), 50);
  for (size_t i = 0; i < 50; ++i) {
    const auto point = read->cloud.points.col(static_cast<Eigen::Index>(i));
    EXPECT_NEAR(point.norm(), range[i], 1e-14);
    EXPECT_NEAR(std::sin(std::atan2(point.y(), point.x()) - azimuth[i]), 0, 1e-14);
    EXPECT_NEAR(std::asin(point.z() / range[i]), elevation[i], 1e-13);
  }
}

std::string Pose(const std::vector<double>& wxyz, const std::vector<double>& translation) {
  std::string text = "<pose type=\"Structure\"><rotation type=\"Structure\">";
  const auto add = [&](char name, double value) {
    const std::string tag(1, name);
    text += "<" + tag + " type=\"Float\"";
    text += value == 0 ? "/>" : ">" + std::to_string(value) + "</" + tag + ">";
  };
  for (size_t i = 0; i < 4; ++i) add("wxyz"[i], wxyz[i]);
  text += "</rotation><translation type=\"Structure\">";
  for (size_t i = 0; i < 3; ++i) add("xyz"[i], translation[i]);
  return text + "</translation></pose>";
}

// A quarter turn about z, x to y; then half a turn about x.
TEST(E57ReaderTest, EachScanIsMovedByItsPose) {
  const double half = std::sqrt(.5);
  E57Scan turned = RealScan(false, 20), flipped = RealScan(true, 30), none = RealScan(true, 0);
  turned.more = Pose({half, 0, 0, half}, {4600000, 5500000, 100});
  flipped.more = Pose({0, 1, 0, 0}, {0, 0, 1});
  const auto read = Read(E57File({turned, none, flipped}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->format, "E57 1.0, 3 scans");
  ASSERT_EQ(read->cloud.points.cols(), 50);
  for (int i = 0; i < 50; ++i) {
    const auto at = [&](int axis) {
      return .125 * static_cast<double>(Formula(axis)[static_cast<size_t>(i < 20 ? i : i - 20)]);
    };
    const Eigen::Vector3d expected =
        i < 20 ? Eigen::Vector3d(4600000 - at(1), 5500000 + at(0), 100 + at(2))
               : Eigen::Vector3d(at(0), -at(1), 1 - at(2));
    EXPECT_NEAR((read->cloud.points.col(i) - expected).norm(), 0, 1e-8) << i;
  }
}

TEST(E57ReaderTest, ColoursAreScaledByTheirLimits) {
  E57Scan scan = RealScan(false, 3);
  scan.columns.push_back(E57Integers("colorRed", 0, 65535, {0, 257, 65535}));
  scan.columns.push_back(E57Integers("colorGreen", 0, 255, {1, 2, 255}));
  scan.columns.push_back(E57Reals("colorBlue", true, {0, .2, 1}));
  scan.columns.push_back(E57Integers("intensity", -666, 666, {-666, 0, 666}, "scale=\"0.25\""));
  const auto read = Read(E57File({scan}));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->cloud.sights.colors.size(), 3u);
  EXPECT_EQ(read->cloud.sights.colors[0], (std::array<uint8_t, 3>{0, 1, 0}));
  EXPECT_EQ(read->cloud.sights.colors[1], (std::array<uint8_t, 3>{1, 2, 51}));
  EXPECT_EQ(read->cloud.sights.colors[2], (std::array<uint8_t, 3>{255, 255, 255}));
  EXPECT_EQ(read->layers.intensity, (std::vector<float>{-166.5f, 0, 166.5f}));
  // A scan without colours beside it: no layer for all, so none.
  EXPECT_TRUE(Read(E57File({scan, RealScan(true, 2)}))->cloud.sights.colors.empty());
}

TEST(E57ReaderTest, LimitsOfColoursOverruleTheirBounds) {
  E57Scan scan = RealScan(false, 2);
  scan.more = "<colorLimits type=\"Structure\">";
  for (const char* name : {"colorRed", "colorGreen", "colorBlue"}) {
    scan.columns.push_back(E57Integers(name, 0, 65535, {0, 255}));
    scan.more += "<" + std::string(name) + "Maximum type=\"Integer\">255</" + name + "Maximum>";
  }
  scan.more += "</colorLimits>";
  const auto read = Read(E57File({scan}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->cloud.sights.colors[1], (std::array<uint8_t, 3>{255, 255, 255}));
}

TEST(E57ReaderTest, FieldsOfExtensionsAndTextAreLeftAlone) {
  E57Scan scan = RealScan(false);
  scan.columns.insert(scan.columns.begin() + 1, {"<x:note type=\"String\"/>", "any bytes"});
  scan.columns.push_back(
      {"<x:pair type=\"Structure\"><a type=\"Float\"/><b type=\"Integer\"/></x:pair>", "12345"});
  scan.columns.push_back({"", "67"});  // the second of the pair
  ExpectFormula(Read(E57File({scan})), .125);
}

// Bytes that can be read once and not sought in.
class PipeBuffer : public std::streambuf {
 public:
  explicit PipeBuffer(std::string bytes) : bytes_(std::move(bytes)) {
    setg(bytes_.data(), bytes_.data(), bytes_.data() + bytes_.size());
  }

 private:
  std::string bytes_;
};

TEST(E57ReaderTest, TheUnitIsTheMetreAndTheReferenceSystemIsKept) {
  EXPECT_EQ(Read(E57File({RealScan(false)}))->place, (ScanPlace{1, UpDirection::kUnknown, ""}));
  const std::string root = std::string(testing::kE57Root) +
                           "<coordinateMetadata type=\"String\"><![CDATA[GEOGCS[\"WGS 84\"]]]>"
                           "</coordinateMetadata>";
  EXPECT_EQ(Read(E57File({RealScan(false)}, 1024, root))->place.crs, "GEOGCS[\"WGS 84\"]");
}

TEST(E57ReaderTest, PipesAreRead) {
  PipeBuffer buffer(E57File({RealScan(false)}));
  std::istream in(&buffer);
  ExpectFormula(ReadScanStream(in, "-"), .125);
}

TEST(E57ReaderTest, ADamagedPageIsNamed) {
  const std::string whole = E57File({RealScan(false)});
  for (size_t page = 0; page < whole.size() / 1024; ++page) {
    std::string bytes = whole;
    bytes[page * 1024 + 700] ^= 1;
    const auto read = Read(bytes);
    ASSERT_EQ(read.status().code(), absl::StatusCode::kDataLoss) << read.status();
    EXPECT_THAT(std::string(read.status().message()),
                HasSubstr("the page at byte " + std::to_string(page * 1024) + " "));
    EXPECT_THAT(std::string(read.status().message()), HasSubstr("copy it again"));
  }
}

// An image, for example: no scan needs it.
TEST(E57ReaderTest, ADamagedPageThatIsNotNeededIsNoError) {
  E57Scan scan = RealScan(false);
  scan.columns.push_back({"<x:note type=\"String\"/>", std::string(9000, 'x')});
  std::string bytes = E57File({scan});
  const size_t at = bytes.rfind("xxxx");
  bytes[at - 2000] = 'y';
  ExpectFormula(Read(bytes), .125);
}

TEST(E57ReaderTest, EveryPrefixIsRefused) {
  const std::string whole = E57File({RealScan(true, 30)});
  for (size_t size = 8; size < whole.size(); ++size) {
    EXPECT_FALSE(Read(whole.substr(0, size)).ok()) << size;
  }
}

struct Refusal {
  const char* name;
  std::string bytes;
  std::vector<std::string> message;
};

std::string WithReplaced(std::string bytes, const std::string& from, const std::string& to) {
  const size_t at = bytes.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return WithRightPageChecksums(bytes.replace(at, from.size(), to));
}

std::string WithNumber(std::string bytes, size_t at, uint64_t value) {
  return WithRightPageChecksums(bytes.replace(at, 8, LowBytesFirst(value)));
}

// With another place of the last scan's section.
std::string WithOffset(std::string bytes, uint64_t offset) {
  const std::string name = "fileOffset=\"";
  const size_t begin = bytes.rfind(name) + name.size();
  const size_t size = bytes.find('"', begin) - begin;
  std::string digits = std::to_string(offset);
  digits.insert(0, size - std::min(size, digits.size()), '0');
  return WithRightPageChecksums(bytes.replace(begin, size, digits));
}

// The beginning of a packet of `last` + 1 bytes.
std::string Packet(uint16_t kind, uint16_t last) {
  return LowBytesFirst(kind) + LowBytesFirst(last);
}

std::vector<Refusal> Refusals() {
  const E57Scan scan = RealScan(false, 40);
  const std::string file = E57File({scan});
  E57Scan state = scan, depth = scan, codec = scan, none = scan, flat = scan, turned = scan,
          text = scan, all_invalid = scan;
  state.records = 1'000'000'000'000;
  codec.codecs = "<vectorChild type=\"Structure\"><zipCodec type=\"Structure\"/></vectorChild>";
  none.records = 0;
  turned.more = Pose({0, 0, 0, 0}, {0, 0, 0});
  text.columns[1] = {"<cartesianY type=\"String\"/>", ""};
  flat.columns.clear();
  for (const char* name : kPlaceNames) flat.columns.push_back(E57Integers(name, 5, 5, {}));
  flat.records = 1'000'000;
  for (int i = 0; i < 100; ++i) depth.more += "<deep>";
  all_invalid.columns.push_back(
      E57Integers("cartesianInvalidState", 0, 2, std::vector<int64_t>(40, 2)));
  E57Scan cut = scan, crowded = scan;
  cut.pieces = {81, 80, 80};
  cut.restarts = true;
  for (int i = 0; i < 2'000'000; ++i) crowded.more += "<a/>";
  const std::string doctype = "<!DOCTYPE e57Root [<!ENTITY a \"&b;\">]><e57Root>";
  E57Scan few = RealScan(false, 30);
  few.records = 36;
  few.other_packets = true;
  E57Scan named = scan;
  named.more = "<description type=\"String\">&bomb;</description>";
  return {
      {"version", WithNumber(file, 8, 2), {"version 2.0", "1.0"}},
      {"minor", WithNumber(file, 8, 1 + (uint64_t{7} << 32)), {"version 1.7"}},
      {"page_size", WithNumber(file, 40, uint64_t{1} << 40), {"pages of 1099511627776 bytes"}},
      {"page_of_0", WithNumber(file, 40, 0), {"pages of 0 bytes"}},
      {"xml_offset", WithNumber(file, 24, 1 << 20), {"XML section", "1048576", "beyond the end"}},
      {"xml_in_checksum", WithNumber(file, 24, 1022), {"XML section", "within a checksum"}},
      {"xml_length", WithNumber(file, 32, ~uint64_t{0}), {"XML section of 18446744073709551615"}},
      {"no_scan", E57File({}), {"no scan"}},
      {"no_points", E57File({none, none}), {"0 points in 2 scans"}},
      {"all_invalid", E57File({all_invalid}), {"all 40 points are marked as invalid"}},
      {"claim", E57File({state}), {"scan 1", "recordCount is 1000000000000", "hold at most"}},
      {"flat", E57File({flat}), {"recordCount is 1000000", "hold at most"}},
      {"codec", E57File({codec}), {"scan 1", "'zipCodec'", "bitPackCodec"}},
      {"no_z", WithReplaced(file, "cartesianZ", "cartesianW"), {"cartesianZ", "'cartesianW'"}},
      {"text", E57File({text}), {"cartesianY", "String"}},
      {"bounds",
       WithReplaced(E57File({flat}), "minimum=\"5\"", "minimum=\"6\""),
       {"cartesianX", "maximum 5", "minimum 6"}},
      {"pose", E57File({turned}), {"quaternion", "length 0"}},
      {"section", WithNumber(file, 48, 182), {"byte 48", "kind is 182"}},
      {"section_size", WithNumber(file, 56, 1 << 20), {"1048576 bytes", "the file has"}},
      {"section_place", WithOffset(file, 99), {"scan 1"}},
      {"first_packet", WithNumber(file, 64, 48), {"first packet", "outside its section"}},
      {"overlap", WithOffset(E57File({RealScan(false), scan}), 48), {"scan 2", "overlaps"}},
      {"kind", WithReplaced(file, Packet(1, 971), Packet(7, 971)), {"byte 80", "kind 7"}},
      {"packet_size",
       WithReplaced(file, Packet(1, 971), Packet(1, 4096)),
       {"byte 80", "4097 bytes"}},
      {"bytestreams",
       WithReplaced(file, Packet(1, 971) + LowBytesFirst(uint16_t{3}),
                    Packet(1, 971) + LowBytesFirst(uint16_t{4})),
       {"byte 80", "4 bytestreams for 3 fields"}},
      {"bytestream_size",
       WithReplaced(file, LowBytesFirst(uint16_t{320}), LowBytesFirst(uint16_t{400})),
       {"byte 80", "972 bytes", "need 1052"}},
      {"cut", E57File({cut}), {"starts anew within a value of cartesianX"}},
      {"crowded", E57File({crowded}), {"more than 2000000 elements and attributes"}},
      {"few_packets", E57File({few}), {"ends after 30 of 36 points"}},
      {"deep", E57File({depth}), {"more than 64 nested elements"}},
      {"doctype", E57File({scan}, 1024, doctype), {"'<!DOCTYPE'"}},
      {"entity", E57File({named}), {"'bomb'"}},
      {"tag", WithReplaced(file, "</codecs>", "</cadecs>"), {"</codecs> is due", "line 4"}},
      {"root",
       WithReplaced(WithReplaced(file, "<e57Root", "<e57Rood"), "</e57Root", "</e57Rood"),
       {"'e57Rood'"}},
  };
}

class E57RefusalTest : public ::testing::TestWithParam<Refusal> {};

TEST_P(E57RefusalTest, SaysPlaceAndReason) {
  const auto read = Read(GetParam().bytes);
  ASSERT_FALSE(read.ok());
  for (const std::string& part : GetParam().message) {
    EXPECT_THAT(std::string(read.status().message()), HasSubstr(part));
  }
}

INSTANTIATE_TEST_SUITE_P(All, E57RefusalTest, ::testing::ValuesIn(Refusals()),
                         [](const auto& param) { return std::string(param.param.name); });

// Any byte of a file changed and the checksums set right again, as no accident does.
TEST(E57ReaderTest, AnyByteChangedUnderRightChecksumsEndsCleanly) {
  E57Scan scan = RealScan(true, 10);
  scan.columns.push_back(E57Integers("cartesianInvalidState", 0, 2, std::vector<int64_t>(10, 0)));
  const std::string whole = E57File({scan, scan}, 256);
  for (size_t at = 0; at < whole.size(); ++at) {
    for (const int change : {0x00, 0xff, 0x80, 0x31}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(change);
      const auto read = Read(WithRightPageChecksums(bytes));
      if (read.ok()) {
        EXPECT_LE(read->cloud.points.cols(), 20);
      } else {
        EXPECT_FALSE(read.status().message().empty());
      }
    }
  }
}

}  // namespace
}  // namespace rilievo::testing
