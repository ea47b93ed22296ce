#include "server/conversion/incoming_scan.h"

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

TEST(IncomingScan, Float32PointsArriveInOrderFromAnyChunks) {
  std::vector<float> values;
  for (int i = 0; i < 3 * 1000; ++i) values.push_back(0.37f * static_cast<float>(i) - 100.0f);
  const std::string bytes = Bytes(values);
  for (const size_t points_per_chunk : {1, 7, 333, 1000}) {
    const PayloadSize size{{CoordinateType::kFloat32}, 1000};
    IncomingScan upload =
        points_per_chunk == 7 ? IncomingScan(size, testing::TempDir()) : IncomingScan(size);
    for (size_t at = 0; at < bytes.size(); at += 12 * points_per_chunk) {
      EXPECT_TRUE(upload.CheckComplete().has_value());
      ASSERT_FALSE(upload.AppendPoints(bytes.substr(at, 12 * points_per_chunk)).has_value());
    }
    EXPECT_FALSE(upload.CheckComplete().has_value());
    EXPECT_EQ(upload.bytes(), 12000);
    const PointCloud scan = upload.Take().Decode({{CoordinateType::kFloat32}, 1000})->scan;
    ASSERT_EQ(scan.points.cols(), 1000);
    for (Eigen::Index i = 0; i < 3000; ++i) {
      ASSERT_EQ(scan.points.data()[i], static_cast<double>(values[static_cast<size_t>(i)]));
    }
  }
}

TEST(IncomingScan, AFolderThatIsGoneIsNoFullOne) {
  IncomingScan upload({{CoordinateType::kFloat32}, 1000}, "/nonexistent");
  const auto error = upload.AppendPoints(std::string(12, '\0'));
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->reason, ErrorCause::kWorkerUnavailable);
  EXPECT_EQ(error->message.find("nonexistent"), std::string::npos);
  EXPECT_NE(upload.written().message().find("nonexistent"), std::string_view::npos);
}

TEST(IncomingScan, Float64KeepsEveryBit) {
  const std::vector<double> values = {
      500000.123456789, 4600000.000000001, -1e-300, std::numeric_limits<double>::infinity(), -0.0,
      std::nan("")};
  IncomingScan upload({{CoordinateType::kFloat64}, 2});
  ASSERT_FALSE(upload.AppendPoints(Bytes(values)).has_value());
  const PointCloud scan = upload.Take().Decode({{CoordinateType::kFloat64}, 2})->scan;
  ASSERT_EQ(scan.points.cols(), 2);
  EXPECT_EQ(std::memcmp(scan.points.data(), values.data(), 48), 0);
}

TEST(IncomingScan, LargeChunksOfBothKinds) {
  const int64_t points = 3 * (kMaxChunkBytes / 24);
  IncomingScan upload({{CoordinateType::kFloat64}, points});
  std::vector<double> chunk(static_cast<size_t>(kMaxChunkBytes / 24 * 3));
  for (int k = 0; k < 3; ++k) {
    for (size_t i = 0; i < chunk.size(); ++i) chunk[i] = k * 1e6 + static_cast<double>(i);
    ASSERT_FALSE(upload.AppendPoints(Bytes(chunk)).has_value());
  }
  const PointCloud scan = upload.Take().Decode({{CoordinateType::kFloat64}, points})->scan;
  EXPECT_EQ(scan.points(0, 0), 0);
  EXPECT_EQ(scan.points(1, kMaxChunkBytes / 24), 1e6 + 1);
  EXPECT_EQ(scan.points(2, points - 1), 2e6 + static_cast<double>(chunk.size() - 1));
}

TEST(IncomingScan, RefusesBrokenChunks) {
  IncomingScan upload({{CoordinateType::kFloat32}, 100});
  for (const size_t size : {size_t{0}, size_t{1}, size_t{13}, size_t{12 * 101},
                            static_cast<size_t>(kMaxChunkBytes) + 12}) {
    const auto error = upload.AppendPoints(std::string(size, 'x'));
    ASSERT_TRUE(error.has_value()) << size;
    EXPECT_EQ(error->code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(error->violations.at(0).field, "points.data");
    EXPECT_EQ(upload.bytes(), 0);
  }
  EXPECT_FALSE(upload.AppendPoints(std::string(12 * 100, 'x')).has_value());
  EXPECT_TRUE(upload.AppendPoints(std::string(12, 'x')).has_value())
      << "one point more than announced";
}

TEST(IncomingScan, MissingPointsAreDataLoss) {
  IncomingScan upload({{CoordinateType::kFloat32}, 100});
  ASSERT_FALSE(upload.AppendPoints(std::string(12 * 99, 'x')).has_value());
  const auto error = upload.CheckComplete();
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(error->message, testing::HasSubstr("99 of 100"));
}

std::string CornerBytes(const std::vector<uint32_t>& corners) { return Bytes(corners); }

TEST(IncomingScan, TrianglesFollowThePointsOfAMesh) {
  for (const size_t per_chunk : {1, 2, 4}) {
    IncomingScan upload({{CoordinateType::kFloat32}, 4, 4});
    ASSERT_FALSE(upload.AppendPoints(std::string(48, '\0')).has_value());
    const std::string bytes = CornerBytes({0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
    for (size_t at = 0; at < bytes.size(); at += 12 * per_chunk) {
      EXPECT_TRUE(upload.CheckComplete().has_value());
      ASSERT_FALSE(upload.AppendTriangles(bytes.substr(at, 12 * per_chunk)).has_value());
    }
    EXPECT_FALSE(upload.CheckComplete().has_value());
    EXPECT_EQ(upload.bytes(), 96);
    const auto mesh = upload.Take().Decode({{CoordinateType::kFloat32}, 4, 4});
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    ASSERT_EQ(mesh->scan.triangles.cols(), 4);
    EXPECT_EQ(mesh->scan.triangles.col(1), Eigen::Vector3i(0, 1, 3));
    EXPECT_EQ(mesh->scan.triangles.col(3), Eigen::Vector3i(1, 2, 3));
  }
}

// The field at fault, with what is said of it.
std::string FaultOf(const std::optional<CallError>& error, ErrorCause reason) {
  if (!error) return "";
  EXPECT_EQ(error->reason, reason) << error->message;
  return error->violations.at(0).field + ": " + error->violations.at(0).description;
}

TEST(IncomingScan, EachKindComesInItsTurn) {
  const std::string point(12, '\0'), triangle = CornerBytes({0, 1, 2});
  IncomingScan scan({{CoordinateType::kFloat32}, 2});
  EXPECT_THAT(FaultOf(scan.AppendTriangles(std::string(triangle)), ErrorCause::kMessageOrder),
              testing::HasSubstr("triangles: header.triangle_count announced none"));
  IncomingScan mesh({{CoordinateType::kFloat32}, 3, 2});
  ASSERT_FALSE(mesh.AppendPoints(point + point).has_value());
  EXPECT_THAT(FaultOf(mesh.AppendTriangles(std::string(triangle)), ErrorCause::kMessageOrder),
              testing::HasSubstr("triangles: they came after 2 of 3 announced points"));
  ASSERT_FALSE(mesh.AppendPoints(std::string(point)).has_value());
  ASSERT_FALSE(mesh.AppendTriangles(std::string(triangle)).has_value());
  EXPECT_THAT(FaultOf(mesh.AppendPoints(std::string(point)), ErrorCause::kMessageOrder),
              testing::HasSubstr("points: they came after triangles"));
  EXPECT_EQ(mesh.bytes(), 48);
}

TEST(IncomingScan, ASurfaceFollowsThePoints) {
  const PayloadSize size{.layout = {CoordinateType::kFloat32}, .points = 2, .base_bytes = 5};
  IncomingScan update(size);
  EXPECT_THAT(FaultOf(update.AppendBase("dss"), ErrorCause::kMessageOrder),
              testing::HasSubstr("base: they came after 0 of 2 announced points"));
  ASSERT_FALSE(update.AppendPoints(std::string(24, '\0')).has_value());
  EXPECT_THAT(FaultOf(update.AppendBase("dss..."), ErrorCause::kInvalidField),
              testing::StartsWith("base.data: "));
  ASSERT_FALSE(update.AppendBase("dss").has_value());
  EXPECT_THAT(FaultOf(update.AppendPoints(std::string(12, '\0')), ErrorCause::kMessageOrder),
              testing::HasSubstr("points: they came after the base surface"));
  EXPECT_EQ(update.CheckComplete()->reason, ErrorCause::kScanIncomplete);
  ASSERT_FALSE(update.AppendBase("..").has_value());
  EXPECT_FALSE(update.CheckComplete().has_value());
  EXPECT_EQ(update.bytes(), 29);
  EXPECT_EQ(update.Take().Decode(size)->base, (std::vector<uint8_t>{'d', 's', 's', '.', '.'}));
  IncomingScan scan({{CoordinateType::kFloat32}, 2});
  EXPECT_THAT(FaultOf(scan.AppendBase("x"), ErrorCause::kMessageOrder),
              testing::HasSubstr("header.base_surface.bytes announced none"));
}

TEST(IncomingScan, RefusesBrokenTriangles) {
  IncomingScan mesh({{CoordinateType::kFloat32}, 3, 2});
  ASSERT_FALSE(mesh.AppendPoints(std::string(36, '\0')).has_value());
  for (const size_t size : {size_t{0}, size_t{1}, size_t{13}, size_t{36}}) {
    EXPECT_THAT(FaultOf(mesh.AppendTriangles(std::string(size, 'x')), ErrorCause::kInvalidField),
                testing::StartsWith("triangles.data: "))
        << size;
  }
  const size_t much = static_cast<size_t>(kMaxChunkBytes) / 12 * 12 + 12;
  EXPECT_THAT(FaultOf(mesh.AppendTriangles(std::string(much, 'x')), ErrorCause::kLimitExceeded),
              testing::StartsWith("triangles.data: "));
  EXPECT_EQ(mesh.bytes(), 36);
}

TEST(IncomingScan, MissingTrianglesAreDataLoss) {
  IncomingScan mesh({{CoordinateType::kFloat32}, 3, 2});
  ASSERT_FALSE(mesh.AppendPoints(std::string(36, '\0')).has_value());
  ASSERT_FALSE(mesh.AppendTriangles(CornerBytes({0, 1, 2})).has_value());
  const auto error = mesh.CheckComplete();
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->reason, ErrorCause::kScanIncomplete);
  EXPECT_THAT(error->message, testing::HasSubstr("1 of 2 announced triangles"));
  EXPECT_EQ(error->metadata.at("limit"), "2");
  EXPECT_EQ(error->metadata.at("value"), "1");
}

}  // namespace
}  // namespace rilievo
