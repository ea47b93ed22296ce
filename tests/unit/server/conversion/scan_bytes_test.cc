#include "server/conversion/scan_bytes.h"

#include <gtest/gtest.h>

#include <cstring>

namespace rilievo {
namespace {

template <typename Real>
std::string Bytes(int points) {
  std::string bytes(static_cast<size_t>(3 * points) * sizeof(Real), '\0');
  for (int i = 0; i < 3 * points; ++i) {
    const Real value = static_cast<Real>(0.37 * i - 100);
    std::memcpy(bytes.data() + static_cast<size_t>(i) * sizeof(Real), &value, sizeof(Real));
  }
  return bytes;
}

template <typename Real>
void ExpectSamePoints(CoordinateType type, int points) {
  const std::string bytes = Bytes<Real>(points);
  const size_t half = bytes.size() / 24 / 2 * 24;
  std::vector<std::string> blocks = {bytes.substr(0, half), bytes.substr(half)};
  const auto from_memory = ScanBytes(blocks).Decode({{type}, points});
  auto file = ScanBytes(blocks).TakeFile();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto from_file = ScanBytes(*std::move(file)).Decode({{type}, points});
  ASSERT_TRUE(from_memory.ok() && from_file.ok());
  ASSERT_EQ(from_memory->scan.points.cols(), points);
  for (int i = 0; i < 3 * points; ++i) {
    ASSERT_EQ(from_memory->scan.points.data()[i],
              static_cast<double>(static_cast<Real>(0.37 * i - 100)));
  }
  EXPECT_EQ(from_memory->scan.points, from_file->scan.points);
  for (const bool in_file : {false, true}) {
    ScanBytes bytes_again(blocks);
    if (in_file) bytes_again = ScanBytes(*ScanBytes(blocks).TakeFile());
    int64_t taken = 0;
    const auto take = [&](const Eigen::Matrix3Xd& block) {
      EXPECT_EQ(block, from_memory->scan.points.middleCols(taken, block.cols()));
      taken += block.cols();
      return absl::OkStatus();
    };
    EXPECT_TRUE(std::move(bytes_again).DecodeInBlocks({{type}, points}, take).ok());
    EXPECT_EQ(taken, points);
  }
}

TEST(ScanBytes, BlocksOfADamagedFileAreNoticed) {
  auto file = ScanBytes({Bytes<float>(20)}).TakeFile();
  const auto take = [](const Eigen::Matrix3Xd&) { return absl::OkStatus(); };
  const absl::Status status = ScanBytes(*std::move(file), std::string(64, 'a'))
                                  .DecodeInBlocks({{CoordinateType::kFloat32}, 20}, take);
  EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(
      ScanBytes({Bytes<float>(3)}).DecodeInBlocks({{CoordinateType::kFloat32}, 20}, take).code(),
      absl::StatusCode::kDataLoss);
}

TEST(ScanBytes, MemoryAndFileGiveTheSamePoints) {
  ExpectSamePoints<float>(CoordinateType::kFloat32, 20);
  ExpectSamePoints<double>(CoordinateType::kFloat64, 20);
  ExpectSamePoints<float>(CoordinateType::kFloat32, 200'000);  // several blocks of the file
  ExpectSamePoints<double>(CoordinateType::kFloat64, 100'000);
}

TEST(ScanBytes, SightsComeWithTheirPoints) {
  PointCloud scan;
  scan.points = Eigen::Matrix3Xd::Random(3, 70'000);  // several blocks of the file
  scan.sights.stations = Eigen::Vector3d(1, 2, 3);
  scan.sights.station_of.assign(70'000, 0);
  scan.sights.station_of[69'999] = kNoStation;
  scan.sights.normals = Eigen::Matrix3Xf::Random(3, 70'000);
  for (int i = 0; i < 70'000; ++i) {
    scan.sights.colors.push_back({static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8), 7});
  }
  const PointLayout layout = LosslessLayout(scan);
  auto file =
      ScanBytes({PackPoints(scan, 0, 30'000, layout), PackPoints(scan, 30'000, 70'000, layout)})
          .TakeFile();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto decoded = ScanBytes(*std::move(file)).Decode({layout, 70'000});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->scan.points, scan.points);
  EXPECT_EQ(decoded->scan.sights.station_of, scan.sights.station_of);
  EXPECT_EQ(decoded->scan.sights.normals, scan.sights.normals);
  EXPECT_EQ(decoded->scan.sights.colors, scan.sights.colors);
}

TEST(ScanBytes, ABrokenFileIsNoticed) {
  auto file = ScanBytes({Bytes<float>(3) + "x"}).TakeFile();
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(ScanBytes(*std::move(file)).Decode({{CoordinateType::kFloat32}, 3}).status().code(),
            absl::StatusCode::kDataLoss);
}

TEST(ScanBytes, TrianglesComeBehindThePoints) {
  PointCloud mesh;
  mesh.points = Eigen::Matrix3Xd::Random(3, 40'000);  // several blocks of the file
  mesh.triangles.resize(3, 70'000);
  for (int i = 0; i < 3 * 70'000; ++i) mesh.triangles.data()[i] = 7 * i % 40'000;
  mesh.triangles(1, 69'999) = -1;
  const PointLayout layout = LosslessLayout(mesh);
  const std::string points = PackPoints(mesh, 0, 40'000, layout);
  const std::string triangles = PackTriangles(mesh, 0, 70'000);
  ASSERT_EQ(static_cast<int64_t>(points.size() + triangles.size()),
            BytesOfRecords(layout, 40'000, 70'000));
  // A block may hold both.
  const std::vector<std::string> blocks = {points + triangles.substr(0, 12), triangles.substr(12)};
  const auto from_memory = ScanBytes(blocks).Decode({layout, 40'000, 70'000});
  auto file = ScanBytes(blocks).TakeFile();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto from_file = ScanBytes(*std::move(file)).Decode({layout, 40'000, 70'000});
  for (const auto* decoded : {&from_memory, &from_file}) {
    ASSERT_TRUE(decoded->ok()) << decoded->status();
    EXPECT_EQ((*decoded)->scan.points, mesh.points);
    EXPECT_EQ((*decoded)->scan.triangles, mesh.triangles);
  }
}

// Points of one header are not the triangles of another.
TEST(ScanBytes, OtherCountsThanThoseThatCameAreNoticed) {
  const PointLayout layout{CoordinateType::kFloat32};
  const auto decode = [&](int64_t points, int64_t triangles) {
    return ScanBytes({std::string(72, '\0')}).Decode({layout, points, triangles}).status().code();
  };
  EXPECT_EQ(decode(4, 2), absl::StatusCode::kOk);
  EXPECT_EQ(decode(4, 1), absl::StatusCode::kDataLoss);
  EXPECT_EQ(decode(5, 2), absl::StatusCode::kDataLoss);
}

TEST(ScanBytes, ASurfaceComesBehindThePoints) {
  const PayloadSize size{
      .layout = {CoordinateType::kFloat32}, .points = 5, .base_bytes = 2'500'000};
  std::string surface(static_cast<size_t>(size.base_bytes), '\0');
  for (size_t i = 0; i < surface.size(); ++i) surface[i] = static_cast<char>(i * i >> 3);
  const std::string points = Bytes<float>(5);
  const std::vector<std::string> blocks = {points + surface.substr(0, 1), surface.substr(1)};
  const auto from_memory = ScanBytes(blocks).Decode(size);
  auto file = ScanBytes(blocks).TakeFile();
  ASSERT_TRUE(file.ok()) << file.status();
  const auto from_file = ScanBytes(*std::move(file)).Decode(size);
  for (const auto* decoded : {&from_memory, &from_file}) {
    ASSERT_TRUE(decoded->ok()) << decoded->status();
    EXPECT_EQ((*decoded)->scan.points.cols(), 5);
    EXPECT_TRUE(std::equal(surface.begin(), surface.end(), (*decoded)->base.begin(),
                           (*decoded)->base.end(),
                           [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; }));
  }
  PayloadSize other = size;
  --other.base_bytes;
  EXPECT_EQ(ScanBytes(blocks).Decode(other).status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace rilievo
