#include "core/pipeline/reconstruct.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <random>
#include <stop_token>
#include <thread>
#include <vector>

#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/code_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

PointCloud Scan(const AnalyticShape& shape, int points, double noise = 0) {
  ScannerOptions options;
  options.points = points;
  options.views = 0;
  options.noise = noise;
  return SimulateScan(shape, options).value().cloud;
}

TEST(ReconstructTest, AllShapesComeBackWithTheirTopologyAndNear) {
  for (const char* name : {"sphere", "torus", "genus2", "cutbox", "pair", "star"}) {
    const ShapePtr shape = MakeShape(name).value();
    const auto result = Reconstruct(Scan(*shape, 10000), ReconstructOptions{}, RunContext{});
    ASSERT_TRUE(result.ok()) << name << ": " << result.status();
    const ReconstructReport& report = result->report;
    EXPECT_EQ(report.genus, shape->genus()) << name;
    EXPECT_EQ(report.components, shape->components()) << name;
    EXPECT_EQ(report.boundary_loops, 0) << name;
    const TriangleMesh mesh =
        Tessellate(result->surface, result->surface.max_level, RunContext{}).value();
    const ShapeError error = MeasureAgainstShape(*shape, mesh.vertices);
    EXPECT_LT(error.rms / shape->diagonal(), 0.001) << name;
  }
}

TEST(ReconstructTest, TheFileHoldsTheSurface) {
  const auto result = Reconstruct(Scan(*MakeTorus(), 10000), ReconstructOptions{}, RunContext{});
  ASSERT_TRUE(result.ok());
  const DecodedSurface decoded = DecodeDss(result->encoded.Concatenate(), RunContext{}).value();
  EXPECT_EQ(decoded.surface.control_mesh.faces, result->surface.control_mesh.faces);
  EXPECT_EQ(decoded.surface.control_mesh.vertices, result->surface.control_mesh.vertices);
  ASSERT_EQ(decoded.surface.heights.size(), result->surface.heights.size());
  double squares = 0, measured = 0;
  for (size_t v = 0; v < decoded.surface.heights.size(); ++v) {
    if (result->surface.sources[v] == HeightSource::kFilled) continue;
    const double difference = decoded.surface.heights[v] - result->surface.heights[v];
    squares += difference * difference;
    measured += 1;
  }
  EXPECT_GT(measured, 5000);
  const ReconstructReport& report = result->report;
  const UncodedError uncoded{report.median_spacing, report.median_noise, 1.0 / 16, true,
                             report.error};
  EXPECT_LT(std::sqrt(squares / measured), 1.1 * CodingError(uncoded));
  EXPECT_EQ(decoded.metadata.scan_points, 10000);
}

TEST(ReconstructTest, DroppingTheScanChangesNothing) {
  const PointCloud scan = Scan(*MakeTorus(), 5000);
  const auto kept = Reconstruct(scan, ReconstructOptions{}, RunContext{});
  const auto dropped = ReconstructAndDrop(scan, ReconstructOptions{}, RunContext{});
  ASSERT_TRUE(kept.ok() && dropped.ok());
  EXPECT_EQ(kept->encoded.Concatenate(), dropped->encoded.Concatenate());
}

TEST(ReconstructTest, TheNumberOfThreadsDoesNotChangeAByte) {
  const PointCloud scan = Scan(*MakeGenus2(), 15000, 0.0005);
  const auto bytes = [&](int threads) {
    RunContext context;
    context.threads = threads;
    return Reconstruct(scan, ReconstructOptions{}, context).value().encoded.Concatenate();
  };
  const std::vector<uint8_t> one = bytes(1);
  EXPECT_EQ(one, bytes(2));
  EXPECT_EQ(one, bytes(4));
}

TEST(ReconstructTest, ASurfaceOfTooManyFacesIsRefusedOrKeptCoarser) {
  const PointCloud scan = Scan(*MakeTorus(), 8000);
  ReconstructOptions options;
  options.max_surface_faces = 6000;
  const auto kept = Reconstruct(scan, options, RunContext{});
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_LE(kept->report.surface_faces, 6000);
  options.max_level = 4;
  const auto refused = Reconstruct(scan, options, RunContext{});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
}

TEST(ReconstructTest, LargeOffsetsCostNothing) {
  const PointCloud near = Scan(*MakeTorus(), 8000);
  PointCloud far = near;
  const Eigen::Vector3d offset(500000, 4600000, 0);
  far.points.colwise() += offset;
  const Reconstruction a = Reconstruct(near, ReconstructOptions{}, RunContext{}).value();
  const Reconstruction b = Reconstruct(far, ReconstructOptions{}, RunContext{}).value();
  EXPECT_NEAR(b.report.error.rms, a.report.error.rms, 1e-6);
  EXPECT_NEAR((b.surface.frame.center - a.surface.frame.center - offset).norm(), 0, 1e-8);
}

TEST(ReconstructTest, AControlMeshOfTheUserIsTakenInScanCoordinates) {
  PointCloud scan = Scan(*MakeSphere(), 5000);
  scan.points = (10 * scan.points).colwise() + Eigen::Vector3d(100, 0, 0);
  ReconstructOptions options;
  options.control.topology = Topology::kUser;
  ControlMesh octahedron;
  octahedron.vertices.resize(3, 6);
  octahedron.vertices << 1, -1, 0, 0, 0, 0, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, -1;
  octahedron.vertices = (12 * octahedron.vertices).colwise() + Eigen::Vector3d(100, 0, 0);
  octahedron.faces.resize(3, 8);
  octahedron.faces << 0, 2, 1, 3, 2, 1, 3, 0, 2, 1, 3, 0, 0, 2, 1, 3, 4, 4, 4, 4, 5, 5, 5, 5;
  options.control.user_mesh = octahedron;
  options.max_level = 4;
  const auto result = Reconstruct(scan, options, RunContext{});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.topology, "user");
  EXPECT_EQ(result->report.control_faces, 8);
  const TriangleMesh mesh = Tessellate(result->surface, 4, RunContext{}).value();
  for (const auto vertex : mesh.vertices.colwise()) {
    EXPECT_NEAR((vertex - Eigen::Vector3d(100, 0, 0)).norm(), 10, 0.2);
  }
}

TEST(ReconstructTest, StopsWithinASecondInEveryStage) {
  const PointCloud scan = Scan(*MakeGenus2(), 20000);
  for (int stage = 0; stage < kStageCount; ++stage) {
    std::stop_source stop;
    std::chrono::steady_clock::time_point asked;
    RunContext context;
    context.stop = stop.get_token();
    context.progress = [&](const Progress& progress) {
      if (static_cast<int>(progress.stage) != stage || stop.stop_requested()) return;
      asked = std::chrono::steady_clock::now();
      stop.request_stop();
    };
    const auto result = Reconstruct(scan, ReconstructOptions{}, context);
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - asked;
    EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled)
        << StageName(static_cast<Stage>(stage));
    EXPECT_LT(waited.count(), 1.0) << StageName(static_cast<Stage>(stage));
  }
}

// Seconds of all processors since the start of this program: what other programs take is not in it.
double ProcessorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// At any moment, not only between the stages: at random ones of each third of the run.
TEST(ReconstructTest, StopsWithinAQuarterOfASecondAtAnyMoment) {
  constexpr int kStops = 3;
  const double begin = ProcessorSeconds();
  ASSERT_TRUE(Reconstruct(Scan(*MakeGenus2(), 25000), ReconstructOptions{}, RunContext{}).ok());
  const double run = 2 * (ProcessorSeconds() - begin);
  const PointCloud scan = Scan(*MakeGenus2(), 50000);
  std::mt19937 random(17);
  std::uniform_real_distribution<double> within(0, 1);
  for (int i = 0; i < kStops; ++i) {
    const double stop_at = ProcessorSeconds() + (i + within(random)) / kStops * run;
    std::stop_source stop;
    double asked = 0;
    RunContext context;
    context.stop = stop.get_token();
    absl::StatusOr<Reconstruction> result;
    std::atomic<bool> over = false;
    std::thread work([&] {
      result = Reconstruct(scan, ReconstructOptions{}, context);
      over = true;
    });
    while (!over && ProcessorSeconds() < stop_at) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    asked = ProcessorSeconds();
    stop.request_stop();
    work.join();
    EXPECT_LT(ProcessorSeconds() - asked, 0.25) << (i + 1) << " of " << kStops;
    EXPECT_TRUE(result.ok() || absl::IsCancelled(result.status())) << result.status();
  }
}

TEST(ReconstructTest, OptionsOutOfRangeAreRefusedFirst) {
  ReconstructOptions options;
  options.max_level = 9;
  const auto result = Reconstruct(PointCloud{}, options, RunContext{});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_NE(result.status().message().find("max_level = 9"), absl::string_view::npos);
}

}  // namespace
}  // namespace rilievo
