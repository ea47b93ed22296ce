#include "server/conversion/scan_size.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rilievo {
namespace {

using testing::ElementsAre;

v1::ReconstructHeader HeaderOfMesh() {
  v1::ReconstructHeader header;
  header.set_point_count(1000);
  header.set_triangle_count(1996);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  return header;
}

// The error that a mesh of these changes gets; nothing when it is taken.
std::optional<CallError> ErrorOfMesh(const std::function<void(v1::ReconstructHeader*)>& change,
                                     const ServerOptions& limits = {}) {
  v1::ReconstructHeader header = HeaderOfMesh();
  change(&header);
  auto parsed = ParseHeader(header, limits);
  if (auto* error = std::get_if<CallError>(&parsed)) return std::move(*error);
  return std::nullopt;
}

std::vector<std::string> FaultsOfMesh(const std::function<void(v1::ReconstructHeader*)>& change) {
  std::vector<std::string> fields;
  const auto error = ErrorOfMesh(change);
  if (!error) return fields;
  EXPECT_EQ(error->reason, ErrorCause::kInvalidField);
  for (const FieldViolation& violation : error->violations) fields.push_back(violation.field);
  return fields;
}

TEST(ScanBytesOf, NeverOverflows) {
  v1::ReconstructHeader header;
  header.set_point_count(10);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  EXPECT_EQ(ScanBytesOf(header), 120);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  EXPECT_EQ(ScanBytesOf(header), 240);
  header.set_triangle_count(7);
  EXPECT_EQ(ScanBytesOf(header), 240 + 84);
  header.set_triangle_count(~uint64_t{0});
  EXPECT_EQ(ScanBytesOf(header), 0);
  header.set_triangle_count(0);
  header.set_point_count(~uint64_t{0});
  EXPECT_EQ(ScanBytesOf(header), 0);
}

v1::ReconstructHeader HeaderOfUpdate() {
  v1::ReconstructHeader header;
  header.set_point_count(7);
  header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT32_LE);
  header.mutable_base_surface()->set_bytes(1000);
  header.mutable_base_surface()->set_vertices(5000);
  return header;
}

TEST(ParseHeaderOfUpdate, CountsReachTheirTarget) {
  v1::ReconstructHeader header = HeaderOfUpdate();
  header.mutable_base_surface()->set_whole(true);
  header.mutable_options()->set_threads(1);
  EXPECT_EQ(ScanBytesOf(header), 7 * 12 + 1000);
  const auto parsed = ParseHeader(header, {});
  ASSERT_TRUE(std::holds_alternative<JobRequest>(parsed)) << std::get<CallError>(parsed).message;
  const auto& request = std::get<JobRequest>(parsed);
  EXPECT_EQ(request.size.points, 7);
  EXPECT_EQ(request.size.base_bytes, 1000);
  EXPECT_EQ(request.base_vertices, 5000);
  EXPECT_TRUE(request.update.whole);
  EXPECT_EQ(request.threads, 1);
}

TEST(ParseHeaderOfUpdate, RefusesWhatDoesNotGoWithIt) {
  v1::ReconstructHeader header = HeaderOfUpdate();
  header.set_triangle_count(3);
  header.mutable_options()->mutable_control()->set_control_faces(100);
  header.mutable_base_surface()->set_bytes(0);
  header.mutable_base_surface()->set_vertices(0);
  const auto fields = [](const v1::ReconstructHeader& wrong, const ServerOptions& limits) {
    std::vector<std::string> names;
    const auto parsed = ParseHeader(wrong, limits);
    if (!std::holds_alternative<CallError>(parsed)) return names;
    for (const auto& violation : std::get<CallError>(parsed).violations)
      names.push_back(violation.field);
    return names;
  };
  EXPECT_THAT(fields(header, {}),
              ElementsAre("header.base_surface.bytes", "header.base_surface.vertices",
                          "header.triangle_count", "header.options"));
  ServerOptions limits;
  limits.max_scan_bytes = 7 * 12 + 999;
  EXPECT_THAT(fields(HeaderOfUpdate(), limits), ElementsAre("header.base_surface.bytes"));
  limits = {};
  limits.max_surface_faces = 4999;
  EXPECT_THAT(fields(HeaderOfUpdate(), limits), ElementsAre("header.base_surface.vertices"));
  header = HeaderOfUpdate();
  header.mutable_base_surface()->set_bytes(~uint64_t{0});
  EXPECT_EQ(ScanBytesOf(header), 0);
  EXPECT_THAT(fields(header, {}), ElementsAre("header.base_surface.bytes"));
}

TEST(ParseHeaderOfMesh, CountsAndOptionsReachTheirTarget) {
  v1::ReconstructHeader header = HeaderOfMesh();
  header.set_colors(true);
  header.mutable_options()->mutable_control()->set_topology(v1::TOPOLOGY_AUTO);
  header.mutable_options()->mutable_control()->set_boundary(v1::BOUNDARY_KEEP);
  header.mutable_options()->mutable_control()->set_creases(v1::CREASES_OFF);
  header.mutable_options()->mutable_encode()->set_max_bytes(9000);
  const auto parsed = ParseHeader(header, {});
  ASSERT_TRUE(std::holds_alternative<JobRequest>(parsed)) << std::get<CallError>(parsed).message;
  const auto& request = std::get<JobRequest>(parsed);
  EXPECT_EQ(request.size.points, 1000);
  EXPECT_EQ(request.size.triangles, 1996);
  EXPECT_TRUE(request.size.layout.colors);
  EXPECT_EQ(request.options.control.topology, Topology::kAuto);
  EXPECT_EQ(request.options.control.creases, CreaseRule::kOff);
  EXPECT_EQ(request.options.encode.max_bytes, 9000);
}

TEST(ParseHeaderOfMesh, ThreeVerticesAreEnough) {
  EXPECT_THAT(FaultsOfMesh([](auto* h) {
                h->set_point_count(3);
                h->set_triangle_count(1);
              }),
              ElementsAre());
  EXPECT_THAT(FaultsOfMesh([](auto* h) { h->set_point_count(2); }),
              ElementsAre("header.point_count"));
}

TEST(ParseHeaderOfMesh, WhatIsOfScansIsRefusedByName) {
  EXPECT_THAT(FaultsOfMesh([](auto* h) { h->set_stations(std::string(24, '\0')); }),
              ElementsAre("header.stations"));
  EXPECT_THAT(FaultsOfMesh([](auto* h) { h->set_normals(true); }), ElementsAre("header.normals"));
  EXPECT_THAT(FaultsOfMesh([](auto* h) { h->mutable_options()->mutable_scan(); }),
              ElementsAre("header.options.scan"));
  for (const auto topology : {v1::TOPOLOGY_PLANAR, v1::TOPOLOGY_SPHERICAL, v1::TOPOLOGY_ARBITRARY,
                              v1::TOPOLOGY_GIVEN, static_cast<v1::Topology>(77)}) {
    EXPECT_THAT(FaultsOfMesh([topology](auto* h) {
                  h->mutable_options()->mutable_control()->set_topology(topology);
                }),
                ElementsAre("header.options.control.topology"));
  }
  EXPECT_THAT(FaultsOfMesh(
                  [](auto* h) { h->mutable_options()->mutable_control()->mutable_control_mesh(); }),
              ElementsAre("header.options.control.control_mesh"));
  EXPECT_THAT(FaultsOfMesh([](auto* h) {
                h->mutable_options()->mutable_control()->set_boundary(v1::BOUNDARY_CLOSE);
              }),
              ElementsAre("header.options.control.boundary"));
  EXPECT_THAT(FaultsOfMesh([](auto* h) {
                h->set_normals(true);
                h->set_stations("x");
                h->mutable_options()->set_max_level(9);
              }),
              ElementsAre("header.stations", "header.normals", "header.options.max_level"));
}

TEST(ParseHeaderOfMesh, SizeIsCheckedAgainstTheLimits) {
  ServerOptions limits;
  limits.max_points = 2000;
  limits.max_scan_bytes = 60'000;
  const auto error = [&](uint64_t points, uint64_t triangles) {
    return ErrorOfMesh(
        [&](v1::ReconstructHeader* header) {
          header->set_point_count(points);
          header->set_triangle_count(triangles);
        },
        limits);
  };
  EXPECT_FALSE(error(1000, 4000).has_value()) << "exactly what all bytes and 2000 points allow";
  EXPECT_FALSE(error(2000, 3000).has_value());
  struct Case {
    uint64_t points, triangles;
    const char *field, *limit, *value;
  };
  const Case cases[] = {
      {1000, 4001, "header.triangle_count", "4000", "4001"},
      {2000, 3001, "header.triangle_count", "3000", "3001"},
      {1000, ~uint64_t{0}, "header.triangle_count", "4000", "18446744073709551615"},
      {2001, 10, "header.point_count", "2000", "2001"},
      {uint64_t{1} << 60, ~uint64_t{0}, "header.point_count", "2000", "1152921504606846976"},
  };
  for (const Case& one : cases) {
    const auto found = error(one.points, one.triangles);
    ASSERT_TRUE(found.has_value()) << one.value;
    EXPECT_EQ(found->reason, ErrorCause::kLimitExceeded);
    ASSERT_EQ(found->violations.size(), 1u);
    EXPECT_EQ(found->violations[0].field, one.field);
    EXPECT_EQ(found->metadata.at("limit"), one.limit);
    EXPECT_EQ(found->metadata.at("value"), one.value);
  }
}

}  // namespace
}  // namespace rilievo
