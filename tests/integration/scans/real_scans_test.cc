// Real scans through the program itself on a real socket.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "client/formats/mesh_reader.h"
#include "client/formats/scan_reader.h"
#include "client/library/reconstruction_client.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/measure_error.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/scans/shared_folder.h"

namespace rilievo {
namespace {

struct RealScan {
  const char* name;
  // Two-sided RMS of the best peer against the ground truth, % of its diagonal; 0: no ground truth.
  double best_peer = 0;
  std::optional<int> genus = {};  // of the true surface, where that is known
  bool closed = false;
};

void PrintTo(const RealScan& scan, std::ostream* out) { *out << scan.name; }

// Two-sided RMS distance to the ground truth, in % of its diagonal.
double PercentOfDiagonal(const TriangleMesh& mesh, const std::string& name) {
  const auto truth = ReadMesh((SharedData() / "gt" / (name + ".ply")).string());
  EXPECT_TRUE(truth.ok()) << truth.status();
  if (!truth.ok()) return INFINITY;
  const Eigen::Matrix3Xd& vertices = truth->mesh.vertices;
  const auto error =
      MeasureTwoSided({mesh.vertices, mesh.triangles}, {vertices, truth->mesh.triangles}, {}, {});
  EXPECT_TRUE(error.ok()) << error.status();
  const double diagonal = (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).norm();
  return error.ok() ? 100 * error->rms / diagonal : INFINITY;
}

class RealScanTest : public testing::TestWithParam<RealScan> {};

TEST_P(RealScanTest, ComesBackAsAManifold) {
  const auto path = SharedData() / (std::string(GetParam().name) + ".ply");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << "the shared scans are not on this machine";
  }
  const auto scan = ReadScan(path.string());
  ASSERT_TRUE(scan.ok()) << scan.status();
  DaemonProcess daemon;
  const ReconstructionClient client(ConnectPlaintext(daemon.address()));
  const auto result = client.Reconstruct(scan->cloud, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const auto decoded = DecodeDss(result->dss, {});
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  const auto mesh = Tessellate(decoded->surface, decoded->surface.max_level, {});
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(mesh->vertices.allFinite());
  const TopologySummary topology =
      SummarizeTopology(mesh->triangles, static_cast<int>(mesh->vertices.cols()));
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.oriented);
  if (GetParam().genus) {
    EXPECT_EQ(topology.genus, *GetParam().genus);
  }
  if (GetParam().closed) {
    EXPECT_TRUE(topology.closed());
  }
  // Nearly all of the scan lies on the surface, whatever its noise and its strays.
  EXPECT_LT(result->report.error().points_to_surface().p95(), 5e-3);
  if (GetParam().best_peer > 0) {
    const double error = PercentOfDiagonal(*mesh, GetParam().name);
    RecordProperty("rms_percent", std::to_string(error));
    EXPECT_LE(error, 2 * GetParam().best_peer);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Shared, RealScanTest,
    testing::Values(RealScan{"owl_multiscan", 0.3607}, RealScan{"seavase_handle", 0.0443},
                    RealScan{"tum_rabbit", 0.1205}, RealScan{"distcap"},
                    RealScan{"mechpart_genus3", 0.0511, 3, true},
                    RealScan{"featuretype_cad", 0.0409, 9}, RealScan{"autzen_hill"},
                    RealScan{"milk_kinect"}, RealScan{"room_lidar"},
                    RealScan{"spot_nonuniform_outliers", 0.1186, 0, true},
                    RealScan{"plasticvase_thin", 0.0625}, RealScan{"facade_scan"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace rilievo
