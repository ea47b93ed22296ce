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
using rilievo::testing::ReadBytes;
using rilievo::testing::SpherePoints;
using rilievo::testing::TextRows;
using rilievo::testing::ValidScans;
using ::testing::HasSubstr;

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
  const auto scan = ReadBytes(GetParam().bytes, GetParam().name);
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

// Counts what is announced and what comes.
class CountedSink : public PointSink {
 public:
  explicit CountedSink(bool has_room) : has_room_(has_room) {}
  absl::Status Expect(uint64_t points) override {
    expected_ += static_cast<int64_t>(points);
    return has_room_ ? absl::OkStatus() : absl::ResourceExhaustedError("no room");
  }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    taken_ += points.cols();
    return has_room_ ? absl::OkStatus() : absl::ResourceExhaustedError("no room");
  }
  int64_t expected() const { return expected_; }
  int64_t taken() const { return taken_; }

 private:
  bool has_room_;
  int64_t expected_ = 0, taken_ = 0;
};

TEST_P(ValidScanTest, ASinkKnowsBeforeWhereTheFileTells) {
  const auto read = [](CountedSink* sink) {
    WantedLayers wanted;
    wanted.sink = sink;
    std::istringstream in(GetParam().bytes);
    return ReadScanStream(in, GetParam().name, wanted).status();
  };
  CountedSink ample(true), full(false);
  ASSERT_TRUE(read(&ample).ok());
  EXPECT_EQ(ample.taken(), GetParam().points);
  if (ample.expected() == 0) return;
  EXPECT_EQ(ample.expected(), GetParam().points);
  EXPECT_THAT(read(&full).message(), HasSubstr("no room"));
  EXPECT_EQ(full.taken(), 0);
}

// A sink that has enough is not given the rest, whether the file tells how many are to come or not.
TEST(ScanReaderTest, ReadingEndsWithTheErrorOfItsSink) {
  class OneBlock : public PointSink {
   public:
    absl::Status Expect(uint64_t /*points*/) override { return absl::OkStatus(); }
    absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
      taken += points.cols();
      return absl::AbortedError("enough");
    }
    int64_t taken = 0;
  };
  for (const auto& sample : ValidScans(20000)) {
    OneBlock sink;
    WantedLayers wanted;
    wanted.sink = &sink;
    std::istringstream in(sample.bytes);
    const absl::Status status = ReadScanStream(in, sample.name, wanted).status();
    EXPECT_TRUE(absl::IsAborted(status)) << sample.name << ": " << status;
    EXPECT_THAT(status.message(), HasSubstr("enough"));
    EXPECT_GT(sink.taken, 0) << sample.name;
    EXPECT_LT(sink.taken, 20000) << sample.name;
  }
}

INSTANTIATE_TEST_SUITE_P(All, ValidScanTest, ::testing::ValuesIn(ValidScans(333)),
                         [](const auto& param) {
                           std::string name = param.param.name;
                           for (char& c : name)
                             c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
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
    const auto scan = ReadBytes(bytes, name);
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
    const auto scan = ReadBytes(
        PlyHeaderText("binary_little_endian", "1", properties) + raw + Raw(0.25) + raw, "a.ply");
    ASSERT_TRUE(scan.ok()) << type << scan.status();
    EXPECT_EQ(scan->cloud.points(0, 0), 0.25);
    EXPECT_EQ(scan->cloud.points(1, 0), value(type, raw.size())) << type;
    EXPECT_EQ(scan->cloud.points(2, 0), value(type, raw.size())) << type;
  }
}

TEST(ScanReaderTest, NonFinitePointsAreKeptForTheCheck) {
  const auto text = ReadBytes("0 0 0\nnan 1 2\n-inf inf 1\n", "a.xyz");
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_TRUE(std::isnan(text->cloud.points(0, 1)));
  EXPECT_EQ(text->cloud.points(0, 2), -std::numeric_limits<double>::infinity());
}

TEST(ScanReaderTest, ColumnsAreTakenByTheNamesOfTheHeading) {
  const auto scan = ReadBytes("time;Z;Y;X;name\n9;3;2;1;a\n9;6;5;4;b\n", "a.csv");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(1) == Eigen::Vector3d(4, 5, 6));
}

TEST(ScanReaderTest, SeveralCountedBlocks) {
  const auto scan = ReadBytes("2\n0 0 0 1\n1 1 1 1\n1\n2 2 2 1\n", "a.pts");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(2) == Eigen::Vector3d(2, 2, 2));
}

TEST(ScanReaderTest, ContinuedLinesOfObjAreJoined) {
  const auto scan = ReadBytes("v 1 \\\n2 3\nv 4 5 6\n", "a.obj");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points.col(0) == Eigen::Vector3d(1, 2, 3));
}

TEST(ScanReaderTest, ContentGoesBeforeExtension) {
  const std::string ply = PlyHeaderText("binary_little_endian", "10") + FloatRows(SpherePoints(10));
  EXPECT_EQ(ReadBytes(ply, "a.xyz")->format, "PLY binary_little_endian");
  EXPECT_EQ(ReadBytes(ply, "noextension")->format, "PLY binary_little_endian");
}

TEST(ScanReaderTest, AClaimBeforeAPipeAllocatesNothing) {
  PipeBuffer buffer(PlyHeaderText("binary_little_endian", "4000000000") +
                    FloatRows(SpherePoints(10)));
  std::istream in(&buffer);
  const auto scan = ReadPlyScan(in);
  EXPECT_EQ(scan.status().code(), absl::StatusCode::kDataLoss) << scan.status();
}

TEST(ScanReaderTest, ErrorsOfFilesBeginWithThePath) {
  const auto missing = ReadScan("/nonexistent/scan.ply");
  EXPECT_EQ(missing.status().code(), absl::StatusCode::kNotFound);
  EXPECT_THAT(std::string(missing.status().message()), HasSubstr("/nonexistent/scan.ply"));
  const auto folder = ReadScan("/");
  EXPECT_EQ(folder.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(folder.status().message()), HasSubstr("folder"));
}

}  // namespace
}  // namespace rilievo
