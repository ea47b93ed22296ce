// LAS: every point format, the precision of map grids, and headers that lie.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <sstream>
#include <string>

#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using testing::LasFile;
using testing::LasSample;
using testing::SpherePoints;

absl::StatusOr<ScanFile> ReadLas(const std::string& bytes, const WantedLayers& wanted = {}) {
  std::istringstream in(bytes);
  return ReadLasScan(in, wanted);
}

template <typename T>
std::string With(std::string bytes, size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
  return bytes;
}

void ExpectLasRefused(const std::string& bytes, absl::StatusCode code, const std::string& part) {
  const auto scan = ReadLas(bytes);
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), code) << scan.status();
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr(part));
}

TEST(LasReaderTest, EveryPointFormatWithItsLayers) {
  const Eigen::Matrix3Xd points = SpherePoints(60);
  for (int format = 0; format <= 10; ++format) {
    SCOPED_TRACE(format);
    const LasSample sample{.minor = 4, .point_format = format};
    const auto scan = ReadLas(LasFile(points, sample), {.intensity = true, .colors = true});
    ASSERT_TRUE(scan.ok()) << scan.status();
    EXPECT_TRUE(scan->cloud.points == points);
    EXPECT_EQ(scan->format, "LAS 1.4, point format " + std::to_string(format));
    ASSERT_EQ(scan->layers.intensity.size(), 60u);
    EXPECT_EQ(scan->layers.intensity[59], 59 * 256);
    const bool colors =
        format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
    ASSERT_EQ(scan->cloud.sights.colors.size(), colors ? 60u : 0u);
    if (colors) {
      EXPECT_EQ(scan->cloud.sights.colors[59], (std::array<uint8_t, 3>{59, 118, 177}));
    }
  }
}

// A variable length record of the LAS file `bytes`, behind those that are there.
std::string WithRecord(std::string bytes, const std::string& user, uint16_t number,
                       const std::string& content) {
  std::string record(54, '\0');
  record.replace(2, user.size(), user);
  record = With(With(record, 18, number), 20, static_cast<uint16_t>(content.size())) + content;
  uint32_t offset, count;
  std::memcpy(&offset, bytes.data() + 96, sizeof offset);
  std::memcpy(&count, bytes.data() + 100, sizeof count);
  bytes.insert(offset, record);
  bytes = With(bytes, 96, static_cast<uint32_t>(offset + record.size()));
  return With(bytes, 100, count + 1);
}

std::string GeoKeys(std::initializer_list<uint16_t> numbers) {
  std::string bytes;
  for (const uint16_t number : numbers) bytes += testing::Raw(number);
  return bytes;
}

TEST(LasReaderTest, TheReferenceSystemIsThatOfTheRecords) {
  const std::string plain = LasFile(SpherePoints(9), {});
  const auto scan = ReadLas(plain);
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->place, (ScanPlace{0, UpDirection::kZ, ""}));
  const std::string keys = GeoKeys({1,    1, 0, 4,     1024, 0, 1, 1,   2048, 0, 1, 4269,  //
                                    3072, 0, 1, 26910, 3076, 0, 1, 9001});
  const std::string with_keys = WithRecord(plain, "LASF_Projection", 34735, keys);
  EXPECT_EQ(ReadLas(with_keys)->place.crs, "EPSG:26910");
  EXPECT_EQ(ReadLas(with_keys)->cloud.points, scan->cloud.points);
  const std::string wkt = "PROJCS[\"NAD83 / UTM zone 10N\",UNIT[\"metre\",1]]";
  const std::string with_both =
      WithRecord(with_keys, "LASF_Projection", 2112, wkt + std::string(3, '\0'));
  EXPECT_EQ(ReadLas(with_both)->place.crs, wkt);
  // Systems that a user defined, keys without a value here, other users' records.
  EXPECT_EQ(ReadLas(WithRecord(plain, "LASF_Projection", 34735,
                               GeoKeys({1, 1, 0, 2, 3072, 0, 1, 32767, 2048, 34736, 1, 4326})))
                ->place.crs,
            "");
  EXPECT_EQ(ReadLas(WithRecord(plain, "somebody", 2112, wkt))->place.crs, "");
  EXPECT_EQ(ReadLas(WithRecord(plain, "LASF_Projection", 2112, "a\n\xff"))->place.crs, "a ?");
}

TEST(LasReaderTest, RecordsThatReachIntoThePointsAreLeft) {
  const std::string plain = WithRecord(LasFile(SpherePoints(9), {}), "LASF_Projection", 2112, "x");
  const auto scan = ReadLas(With(plain, 227 + 64 + 20, uint16_t{60000}));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->place.crs, "");
  EXPECT_EQ(scan->cloud.points.cols(), 9);
}

TEST(LasReaderTest, LayersAreReadOnlyWhenWanted) {
  const auto scan = ReadLas(LasFile(SpherePoints(9), {.point_format = 3}));
  ASSERT_TRUE(scan.ok());
  EXPECT_TRUE(scan->layers.intensity.empty());
  EXPECT_TRUE(scan->cloud.sights.colors.empty());
}

TEST(LasReaderTest, ColorsOfSixteenBitsKeepTheirHighBytes) {
  const auto scan =
      ReadLas(LasFile(SpherePoints(60), {.point_format = 2, .color_step = 256}), {.colors = true});
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->cloud.sights.colors[59], (std::array<uint8_t, 3>{59, 118, 177}));
}

// A grid of 4.6e6 metres: float would keep half a metre.
TEST(LasReaderTest, MapGridsKeepTheirMillimetres) {
  Eigen::Matrix3Xd points(3, 1000);
  for (int i = 0; i < 1000; ++i) {
    points.col(i) << 4.6e6 + 0.001 * i, 5.5e6 - 0.001 * i * i, 312.5 + 0.001 * (i % 7);
  }
  const LasSample sample{.scale = 0.001, .offset = Eigen::Vector3d(4.6e6, 5.5e6, 0)};
  const auto scan = ReadLas(LasFile(points, sample));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_LT((scan->cloud.points - points).cwiseAbs().maxCoeff(), 2e-9);
  // Without an offset the integers are large, and nothing is lost either.
  const auto plain = ReadLas(LasFile(points / 4, {.scale = 0.001}));
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_LT((plain->cloud.points - points / 4).cwiseAbs().maxCoeff(), 5e-4 + 2e-9);
}

TEST(LasReaderTest, WithheldPointsAreLeftOut) {
  const std::string old = LasFile(SpherePoints(10), {.extra = 2});
  const size_t first = old.size() - 10 * 22;
  const auto scan = ReadLas(With(With(old, first + 15, '\x81'), first + 22 + 15, '\x1f'));
  ASSERT_TRUE(scan.ok());
  EXPECT_EQ(scan->cloud.points.cols(), 9);
  EXPECT_THAT(scan->format, HasSubstr("without 1 withheld"));
  const std::string recent = LasFile(SpherePoints(2), {.minor = 4, .point_format = 6});
  const size_t second = recent.size() - 30;
  const auto left = ReadLas(With(recent, second + 15, '\x04'));
  ASSERT_TRUE(left.ok());
  EXPECT_TRUE(left->cloud.points == SpherePoints(2).leftCols(1));
  ExpectLasRefused(With(With(recent, second + 15, '\x04'), second - 15, '\x04'),
                   absl::StatusCode::kInvalidArgument, "withheld");
}

TEST(LasReaderTest, LazWithoutTheRecordThatSaysHowItIsPackedIsRefused) {
  const std::string laz = With(LasFile(SpherePoints(10), {}), 104, uint8_t{0x80});
  ExpectLasRefused(laz, absl::StatusCode::kInvalidArgument, "the record of LASzip");
}

TEST(LasReaderTest, HeadersThatLie) {
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  constexpr auto kLost = absl::StatusCode::kDataLoss;
  const std::string las = LasFile(SpherePoints(10), {});
  const std::string las14 = LasFile(SpherePoints(10), {.minor = 4, .point_format = 6});
  ExpectLasRefused(With(las, 107, uint32_t{11}), kLost, "holds 10");
  ExpectLasRefused(With(las, 107, uint32_t{4000000000}), kLost, "4000000000");
  ExpectLasRefused(With(las14, 247, uint64_t{1} << 63), kLost, "9223372036854775808");
  ExpectLasRefused(With(las, 107, uint32_t{0}), kInvalid, "0 points");
  ExpectLasRefused(With(las, 96, uint32_t{4000000000}), kLost, "truncated");
  ExpectLasRefused(With(las, 96, uint32_t{100}), kInvalid, "within the header");
  ExpectLasRefused(With(las, 94, uint16_t{100}), kInvalid, "size of 100");
  ExpectLasRefused(With(las14, 94, uint16_t{300}), kInvalid, "needs 375");
  ExpectLasRefused(With(las, 104, uint8_t{11}), kInvalid, "point format 11");
  ExpectLasRefused(With(las, 104, uint8_t{1}), kInvalid, "needs 28");
  ExpectLasRefused(With(las, 105, uint16_t{0}), kInvalid, "points of 0 bytes");
  ExpectLasRefused(With(las, 25, uint8_t{5}), kInvalid, "version 1.5");
  ExpectLasRefused(With(las, 24, uint8_t{2}), kInvalid, "version 2.2");
  ExpectLasRefused(With(las, 131, 0.0), kInvalid, "of x");
  ExpectLasRefused(With(las, 139, std::nan("")), kInvalid, "of y");
  ExpectLasRefused(With(las, 171, HUGE_VAL), kInvalid, "of z");
  ExpectLasRefused("PASF" + las.substr(4), kInvalid, "LASF");
}

}  // namespace
}  // namespace rilievo
