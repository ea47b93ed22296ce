// Files that were made to hurt, read and sent to the program itself on a real socket: each ends as
// the README beside them says, and a file that nobody has judged yet fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <string>

#include "client/formats/scan_reader.h"
#include "client/library/reconstruction_client.h"
#include "core/codec/container/dss.h"
#include "server/health_probe.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/scans/shared_folder.h"

namespace rilievo {
namespace {

using absl::StatusCode;

std::filesystem::path BadFolder() { return SharedData() / "bad"; }

struct Outcome {
  StatusCode reader = StatusCode::kOk;
  StatusCode server = StatusCode::kOk;  // asked only when the reader took the file
  std::string words = {};               // the error holds them
  double radius = 0;                    // of the sphere around the origin that must come back
  double off = 0.1;                     // from that sphere at most, radii
  int64_t dropped = 0;                  // non-finite points, duplicates and strays in the report
  int components = 1;
  bool warned = false;
};

Outcome Unreadable(StatusCode code) { return {.reader = code}; }

// The points are too few or span no surface.
Outcome Refused(const std::string& words) {
  return {.server = StatusCode::kInvalidArgument, .words = words};
}

const std::map<std::string, Outcome>& Outcomes() {
  static const std::map<std::string, Outcome> outcomes = {
      {"empty_file", Unreadable(StatusCode::kInvalidArgument)},
      {"zero_vertices", Unreadable(StatusCode::kInvalidArgument)},
      {"truncated_binary", Unreadable(StatusCode::kDataLoss)},
      {"truncated_header", Unreadable(StatusCode::kDataLoss)},
      {"truncated_ascii", Unreadable(StatusCode::kDataLoss)},
      {"claims_4e9_vertices", Unreadable(StatusCode::kDataLoss)},
      {"claims_2e64_vertices", Unreadable(StatusCode::kInvalidArgument)},
      {"negative_vertices", Unreadable(StatusCode::kInvalidArgument)},
      {"huge_list_count", Unreadable(StatusCode::kInvalidArgument)},
      {"no_z", Unreadable(StatusCode::kInvalidArgument)},
      {"ascii_garbage", Unreadable(StatusCode::kInvalidArgument)},
      {"unknown_format", Unreadable(StatusCode::kInvalidArgument)},
      {"unknown_type", Unreadable(StatusCode::kInvalidArgument)},
      {"two_vertex_elements", Unreadable(StatusCode::kInvalidArgument)},
      {"random_bytes", Unreadable(StatusCode::kInvalidArgument)},
      {"png_named", Unreadable(StatusCode::kInvalidArgument)},
      {"no_newline_magic", Unreadable(StatusCode::kInvalidArgument)},
      {"all_nan", Refused("0 distinct finite points")},
      {"one_point", Refused("point_count: 1")},
      {"three_points", Refused("point_count: 3")},
      {"ascii_spaces", Refused("point_count: 5")},
      {"faces_before_vertices", Refused("point_count: 4")},
      {"all_identical", Refused("identical")},
      {"collinear", Refused("collinear")},
      {"nan_inf", {.radius = 1, .dropped = 27, .warned = true}},
      {"duplicates_x5", {.radius = 1, .dropped = 1200}},
      {"huge_1e30", {.radius = 1e30}},
      {"tiny_1e-30", {.radius = 1e-30}},
      {"far_outlier", {.radius = 1, .dropped = 1, .warned = true}},
      // 200 random points: a chord over the widest gap lies 0.10 deep.
      {"list_property_vertex", {.radius = 1, .off = 0.15}},
      {"big_endian", {.radius = 1}},
      {"crlf_ascii", {.radius = 1}},
      {"crlf_header_binary", {.radius = 1}},
      {"mixed_props", {.radius = 1}},
      {"long_comment", {.radius = 1}},
      {"coplanar_grid", {}},
      {"utm_float32", {.dropped = 19}},
      {"utm_double", {}},
      {"two_components", {.components = 2}},
      {"moebius", {}},  // cut open: a surface of the format has two sides
      {"uniform_volume", {.warned = true}},
  };
  return outcomes;
}

void CheckSurface(const ReconstructResult& result, const Outcome& outcome) {
  const v1::ReconstructReport& report = result.report;
  EXPECT_EQ(report.non_finite() + report.duplicates() + report.strays(), outcome.dropped);
  EXPECT_EQ(report.components(), outcome.components);
  EXPECT_GE(report.warnings_size(), outcome.warned ? 1 : 0);
  const auto decoded = DecodeDss(result.dss, {});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  const auto mesh = Tessellate(decoded->surface, decoded->surface.max_level, {});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->vertices.allFinite());
  if (outcome.radius == 0) return;
  const Eigen::RowVectorXd radii = (mesh->vertices / outcome.radius).colwise().norm();
  EXPECT_NEAR(radii.minCoeff(), 1, outcome.off);
  EXPECT_NEAR(radii.maxCoeff(), 1, outcome.off);
}

// Each within 5 s and 300 MB.
TEST(BadScans, EachEndsAsItsReadmeSaysAndTheServerServesOn) {
  if (!std::filesystem::exists(BadFolder())) {
    GTEST_SKIP() << "the shared scans are not on this machine: no folder " << BadFolder();
  }
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  size_t seen = 0;
  for (const auto& entry : std::filesystem::directory_iterator(BadFolder())) {
    if (entry.path().extension() == ".md") continue;
    const std::string name = entry.path().stem().string();
    SCOPED_TRACE(name);
    const auto known = Outcomes().find(name);
    if (known == Outcomes().end()) {
      ADD_FAILURE() << "a new file: say in Outcomes() how it must end";
      continue;
    }
    ++seen;
    const Outcome& outcome = known->second;
    const auto scan = ReadScan(entry.path().string());
    EXPECT_EQ(scan.status().code(), outcome.reader) << scan.status();
    if (!scan.ok()) continue;
    CallOptions call;
    call.timeout = std::chrono::seconds(5);
    const auto result = client.Reconstruct(scan->cloud, {}, {}, call);
    EXPECT_EQ(result.status().code(), outcome.server) << result.status();
    EXPECT_THAT(result.status().message(), testing::HasSubstr(outcome.words));
    if (result.ok()) CheckSurface(*result, outcome);
    EXPECT_LT(daemon.PeakBytes(), int64_t{300} << 20);
    ASSERT_TRUE(ProbeHealth(daemon.address(), std::chrono::seconds(5)).ok());
  }
  EXPECT_EQ(seen, Outcomes().size());
}

}  // namespace
}  // namespace rilievo
