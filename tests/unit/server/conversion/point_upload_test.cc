#include "server/conversion/point_upload.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace rilievo {
namespace {

template <typename Real>
std::string Bytes(const std::vector<Real>& values) {
  std::string bytes(values.size() * sizeof(Real), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

TEST(PointUpload, Float32PointsArriveInOrderFromAnyChunks) {
  std::vector<float> values;
  for (int i = 0; i < 3 * 1000; ++i) values.push_back(0.37f * static_cast<float>(i) - 100.0f);
  const std::string bytes = Bytes(values);
  for (const size_t points_per_chunk : {1, 7, 333, 1000}) {
    PointUpload upload(1000, {CoordinateType::kFloat32});
    for (size_t at = 0; at < bytes.size(); at += 12 * points_per_chunk) {
      EXPECT_TRUE(upload.CheckComplete().has_value());
      ASSERT_FALSE(upload.Append(bytes.substr(at, 12 * points_per_chunk)).has_value());
    }
    EXPECT_FALSE(upload.CheckComplete().has_value());
    EXPECT_EQ(upload.bytes(), 12000);
    const PointCloud scan = *upload.TakePoints().Decode({CoordinateType::kFloat32});
    ASSERT_EQ(scan.points.cols(), 1000);
    for (Eigen::Index i = 0; i < 3000; ++i) {
      ASSERT_EQ(scan.points.data()[i], static_cast<double>(values[static_cast<size_t>(i)]));
    }
  }
}

TEST(PointUpload, Float64KeepsEveryBit) {
  const std::vector<double> values = {
      500000.123456789, 4600000.000000001, -1e-300, std::numeric_limits<double>::infinity(), -0.0,
      std::nan("")};
  PointUpload upload(2, {CoordinateType::kFloat64});
  ASSERT_FALSE(upload.Append(Bytes(values)).has_value());
  const PointCloud scan = *upload.TakePoints().Decode({CoordinateType::kFloat64});
  ASSERT_EQ(scan.points.cols(), 2);
  EXPECT_EQ(std::memcmp(scan.points.data(), values.data(), 48), 0);
}

TEST(PointUpload, LargeChunksOfBothKinds) {
  const int64_t points = 3 * (kMaxChunkBytes / 24);
  PointUpload upload(points, {CoordinateType::kFloat64});
  std::vector<double> chunk(static_cast<size_t>(kMaxChunkBytes / 24 * 3));
  for (int k = 0; k < 3; ++k) {
    for (size_t i = 0; i < chunk.size(); ++i) chunk[i] = k * 1e6 + static_cast<double>(i);
    ASSERT_FALSE(upload.Append(Bytes(chunk)).has_value());
  }
  const PointCloud scan = *upload.TakePoints().Decode({CoordinateType::kFloat64});
  EXPECT_EQ(scan.points(0, 0), 0);
  EXPECT_EQ(scan.points(1, kMaxChunkBytes / 24), 1e6 + 1);
  EXPECT_EQ(scan.points(2, points - 1), 2e6 + static_cast<double>(chunk.size() - 1));
}

TEST(PointUpload, RefusesBrokenChunks) {
  PointUpload upload(100, {CoordinateType::kFloat32});
  for (const size_t size : {size_t{0}, size_t{1}, size_t{13}, size_t{12 * 101},
                            static_cast<size_t>(kMaxChunkBytes) + 12}) {
    const auto error = upload.Append(std::string(size, 'x'));
    ASSERT_TRUE(error.has_value()) << size;
    EXPECT_EQ(error->code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(error->violations.at(0).field, "points.data");
    EXPECT_EQ(upload.bytes(), 0);
  }
  EXPECT_FALSE(upload.Append(std::string(12 * 100, 'x')).has_value());
  EXPECT_TRUE(upload.Append(std::string(12, 'x')).has_value()) << "one point more than announced";
}

TEST(PointUpload, MissingPointsAreDataLoss) {
  PointUpload upload(100, {CoordinateType::kFloat32});
  ASSERT_FALSE(upload.Append(std::string(12 * 99, 'x')).has_value());
  const auto error = upload.CheckComplete();
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(error->message, testing::HasSubstr("99 of 100"));
}

}  // namespace
}  // namespace rilievo
