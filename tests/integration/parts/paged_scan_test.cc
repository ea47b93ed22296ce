// Surfaces of scans that lie on disk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/codec/container/open_dss.h"
#include "core/loop/face_vertices.h"
#include "core/paging/scan_pager.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/shape_input.h"
#include "tests/benchmark/seams.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

Eigen::Matrix3Xd EvenPoints(const AnalyticShape& shape, int points, double noise = 0) {
  ScannerOptions options;
  options.points = points;
  options.views = 0;
  options.noise = noise;
  return SimulateScan(shape, options).value().cloud.points;
}

PagedScan OnDisk(const Eigen::Matrix3Xd& points) {
  ScanPager pager = ScanPager::Create(::testing::TempDir(), 20000).value();
  EXPECT_TRUE(pager.Add(points).ok());
  return pager.Finish(RunContext{}).value();
}

Reconstruction InParts(const Eigen::Matrix3Xd& points, const PartSizes& sizes,
                       const ReconstructOptions& options = {}, int threads = 0) {
  RunContext context;
  context.threads = threads;
  return ReconstructPaged(OnDisk(points), sizes, options, context).value();
}

DisplacedSurface DecodedOf(const Reconstruction& made) {
  return DecodeDss(made.encoded.Concatenate(), RunContext{})->surface;
}

double RmsFrom(const AnalyticShape& shape, const DisplacedSurface& surface) {
  const TriangleMesh mesh = Tessellate(surface, surface.max_level, RunContext{}).value();
  return MeasureAgainstShape(shape, mesh.vertices).rms / shape.diagonal();
}

// Coded and measured in blocks of 2 000 vertices.
constexpr PartSizes kBlocks{.coarse_points = 15000, .part_points = 12288, .block_vertices = 2000};
// Heights by parts, all coded at once.
constexpr PartSizes kAtOnce{.coarse_points = 15000, .part_points = 12288};

// Clean, noisy, with sharp edges, of two components.
struct PagedCase {
  std::string shape;
  double noise;
  // What chance does to the error across the surface, which samples beside sharp edges make up.
  double chance = 0.03;
};
class PagedShapes : public ::testing::TestWithParam<PagedCase> {};
INSTANTIATE_TEST_SUITE_P(PagedScanTest, PagedShapes,
                         ::testing::Values(PagedCase{"genus2", 0}, PagedCase{"star", 0.001},
                                           PagedCase{"cutbox", 0, 0.15}, PagedCase{"pair", 0}));

TEST_P(PagedShapes, PartsAndBlocksAreAsGoodAsTheWhole) {
  const ShapePtr shape = MakeShape(GetParam().shape).value();
  const Eigen::Matrix3Xd points = EvenPoints(*shape, 15000, GetParam().noise);
  const Reconstruction whole =
      Reconstruct(PointCloud{points}, ReconstructOptions{}, RunContext{}).value();
  const Reconstruction parts = InParts(points, kAtOnce);
  EXPECT_EQ(parts.report.genus, shape->genus());
  EXPECT_EQ(parts.report.components, shape->components());
  EXPECT_EQ(parts.report.points_in, points.cols());
  EXPECT_EQ(parts.surface.max_level, whole.surface.max_level);
  EXPECT_EQ(parts.surface.control_mesh.faces, whole.surface.control_mesh.faces);
  EXPECT_LT(RmsFrom(*shape, parts.surface), 1.05 * RmsFrom(*shape, whole.surface));
  EXPECT_LT(parts.report.encoded_bytes, 1.1 * static_cast<double>(whole.report.encoded_bytes));

  const Reconstruction blocks = InParts(points, kBlocks);
  ASSERT_TRUE(blocks.surface.heights.empty()) << "not coded in blocks";
  const DisplacedSurface decoded = DecodedOf(blocks);
  EXPECT_LT(RmsFrom(*shape, decoded), 1.02 * RmsFrom(*shape, DecodedOf(parts)));
  EXPECT_LT(blocks.report.encoded_bytes, 1.1 * static_cast<double>(parts.report.encoded_bytes));
  EXPECT_EQ(blocks.report.surface_vertices, static_cast<int64_t>(decoded.heights.size()));
  EXPECT_EQ(blocks.report.surface_faces, parts.report.surface_faces);
  EXPECT_EQ(blocks.report.heights_filled, parts.report.heights_filled);
  EXPECT_EQ(blocks.report.heights_smoothed, parts.report.heights_smoothed);
  EXPECT_NEAR(blocks.report.error.rms, parts.report.error.rms, 0.03 * parts.report.error.rms);
  EXPECT_NEAR(blocks.report.error.across_rms, parts.report.error.across_rms,
              GetParam().chance * parts.report.error.across_rms);
}

// Fewer than the whole's, as in a clean scan the heights of a vertex come of the points around it.
TEST(PagedScanTest, HeightsOfACleanScanAreThoseOfTheWhole) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("star").value(), 15000);
  const Reconstruction whole =
      Reconstruct(PointCloud{points}, ReconstructOptions{}, RunContext{}).value();
  const Reconstruction parts = InParts(points, kAtOnce);
  ASSERT_EQ(parts.surface.heights.size(), whole.surface.heights.size());
  const double spacing = whole.report.median_spacing;
  int64_t apart = 0;
  double farthest = 0;
  for (size_t v = 0; v < whole.surface.heights.size(); ++v) {
    const double difference = std::abs(double{parts.surface.heights[v]} - whole.surface.heights[v]);
    apart += difference > 0.02 * spacing;
    farthest = std::max(farthest, difference);
  }
  EXPECT_LT(static_cast<double>(apart), 0.001 * static_cast<double>(whole.surface.heights.size()));
  EXPECT_LT(farthest, 0.2 * spacing);
}

TEST(PagedScanTest, AllPointsTellOfHeightsThatThinnedOnesDoNotKnow) {
  const ShapePtr shape = MakeShape("genus2").value();
  const Eigen::Matrix3Xd points = EvenPoints(*shape, 24000);
  const PartSizes sizes{.coarse_points = 4000, .part_points = 16384};
  const Reconstruction parts = InParts(points, sizes);
  PointCloud thinned;
  thinned.points = OnDisk(points).Thinned(sizes.coarse_points, {}, RunContext{}).value();
  ASSERT_LE(thinned.points.cols(), 4000);
  const Reconstruction coarse = Reconstruct(thinned, ReconstructOptions{}, RunContext{}).value();
  EXPECT_LT(RmsFrom(*shape, parts.surface), 0.5 * RmsFrom(*shape, coarse.surface));
  EXPECT_EQ(parts.report.points_used, 24000);
}

// Fitted to an eighth of the points it would be 6 % farther off.
TEST(PagedScanTest, ThinnedOrNotTheDomainIsFittedToAllPoints) {
  const ShapePtr shape = MakeShape("genus2").value();
  const Eigen::Matrix3Xd points = EvenPoints(*shape, 24000);
  const auto domain_rms = [&](int64_t coarse_points) {
    ReconstructOptions options;
    options.max_level = 1;
    options.measure = false;
    DisplacedSurface surface =
        InParts(points, {.coarse_points = coarse_points, .part_points = 20480}, options).surface;
    std::fill(surface.heights.begin(), surface.heights.end(), 0.0f);
    return RmsFrom(*shape, surface);
  };
  EXPECT_LT(domain_rms(3000), 1.02 * domain_rms(24000));
}

TEST(PagedScanTest, PartsInQuadsAreAsGoodAsTheWhole) {
  const ShapePtr shape = MakeShape("genus2").value();
  const Eigen::Matrix3Xd points = EvenPoints(*shape, 20000);
  ReconstructOptions options;
  options.control.scheme = DomainScheme::kCatmullClark;
  const Reconstruction whole = Reconstruct(PointCloud{points}, options, RunContext{}).value();
  const PartSizes sizes{.coarse_points = 20000, .part_points = 16384, .block_vertices = 2000};
  const Reconstruction parts = InParts(points, sizes, options);
  const DisplacedSurface decoded = DecodedOf(parts);
  EXPECT_TRUE(decoded.control_mesh.quads());
  EXPECT_EQ(parts.report.genus, 2);
  EXPECT_EQ(decoded.control_mesh.faces.cols(), whole.surface.control_mesh.faces.cols());
  EXPECT_LT(RmsFrom(*shape, decoded), 1.05 * RmsFrom(*shape, DecodedOf(whole)));
  EXPECT_LT(parts.report.encoded_bytes, 1.1 * static_cast<double>(whole.report.encoded_bytes));
}

// Of a scan that is thinned to a sixth; coded at once, and in blocks.
TEST(PagedScanTest, ErrorsAreThoseOfAllPoints) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("genus2").value(), 15000, 0.0005);
  const ScanSurface scan =
      PointsOfScan(PointCloud{points}, ReconstructOptions{}, RunContext{}).value();
  Shape used = PointsToMeasure(scan.cloud);
  for (const int64_t block : {1 << 20, 4000}) {
    const Reconstruction made =
        InParts(points, {.coarse_points = 2500, .part_points = 12288, .block_vertices = block});
    const DisplacedSurface surface = DecodedOf(made);
    for (Eigen::Index i = 0; i < used.vertices.cols(); ++i) {
      used.vertices.col(i) =
          surface.frame.UnitFromScan(scan.frame.ScanFromUnit(scan.cloud.points.col(i)));
    }
    const TwoSidedError& stated = made.report.error;
    const TwoSidedError whole =
        MeasureSurface(surface, FilledVertices(surface, {}), used, RunContext{}).value();
    EXPECT_GT(stated.b_to_a.samples, 14750);
    EXPECT_EQ(stated.b_to_a.samples, made.report.points_used);
    EXPECT_NEAR(stated.b_to_a.rms, whole.b_to_a.rms, 0.01 * whole.b_to_a.rms);
    EXPECT_NEAR(stated.b_to_a.p95, whole.b_to_a.p95, 0.01 * whole.b_to_a.p95);
    EXPECT_NEAR(stated.a_to_b.rms, whole.a_to_b.rms, 0.01 * whole.a_to_b.rms);
    EXPECT_NEAR(stated.across_rms, whole.across_rms, 0.02 * whole.across_rms);
  }
}

TEST(PagedScanTest, TheNumberOfThreadsDoesNotChangeAByte) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("torus").value(), 10000, 0.0005);
  const PartSizes sizes{.coarse_points = 4000, .part_points = 8192};
  const auto bytes = [&](int threads) {
    return InParts(points, sizes, {}, threads).encoded.Concatenate();
  };
  EXPECT_EQ(bytes(1), bytes(3));
}

TEST(PagedScanTest, TheOrderOfThePointsDoesNotChangeAByte) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("torus").value(), 10000);
  const PartSizes sizes{.coarse_points = 4000, .part_points = 8192};
  EXPECT_EQ(InParts(points, sizes).encoded.Concatenate(),
            InParts(points.rowwise().reverse(), sizes).encoded.Concatenate());
}

// Its points are three times as dense as their noise is thick.
TEST(PagedScanTest, ThickNoiseIsNoThickerInTheCoarsePass) {
  const ShapePtr shape = MakeShape("star").value();
  const Eigen::Matrix3Xd points = EvenPoints(*shape, 100000, 0.01);
  const Reconstruction whole =
      Reconstruct(PointCloud{points}, ReconstructOptions{}, RunContext{}).value();
  const Reconstruction parts = InParts(points, {.coarse_points = 40000, .part_points = 40960});
  EXPECT_EQ(parts.report.genus, 0);
  EXPECT_EQ(parts.report.boundary_loops, 0);
  EXPECT_LT(RmsFrom(*shape, parts.surface), 1.2 * RmsFrom(*shape, whole.surface));
}

TEST(PagedScanTest, BordersStayOpen) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("terrain").value(), 10000);
  const Reconstruction parts = InParts(points, {.coarse_points = 4000, .part_points = 8192});
  EXPECT_EQ(parts.report.boundary_loops, 1);
  EXPECT_EQ(parts.report.components, 1);
}

TEST(PagedScanTest, TheLevelAskedForIsTaken) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("sphere").value(), 5000);
  ReconstructOptions options;
  for (const int level : {0, 1, 4}) {
    options.max_level = level;
    const Reconstruction parts = InParts(points, {2500, 4096}, options);
    EXPECT_EQ(parts.surface.max_level, level);
  }
}

// So many faces stand in groups, though all of them are one block.
TEST(PagedScanTest, ASurfaceOfManyFacesMayFitIntoABlock) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("sphere").value(), 20000);
  ReconstructOptions options;
  options.control.target_faces = 5000;
  for (const int level : {1, 2}) {
    options.max_level = level;
    const Reconstruction parts = InParts(points, {}, options);
    EXPECT_GT(parts.surface.control_mesh.faces.cols(), 4096);
    EXPECT_EQ(parts.surface.max_level, level);
  }
}

// Clean, and noisy.
TEST(PagedScanTest, BordersBetweenGroupsDoNotShow) {
  for (const double noise : {0.0, 0.0005}) {
    const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("sphere").value(), 40000, noise);
    const PartSizes sizes{.coarse_points = 40000, .part_points = 36864, .block_vertices = 8000};
    const std::vector<uint8_t> dss = InParts(points, sizes).encoded.Concatenate();
    const SeamFigures seams = MeasureSeams(dss, RunContext{}).value();
    EXPECT_GT(seams.border.control_edges, 50);
    EXPECT_LT(seams.AngleRatio(), 1.05) << noise;
    EXPECT_LT(seams.BendRatio(), 1.05) << noise;
  }
}

TEST(PagedScanTest, AStepBetweenGroupsWouldShow) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("sphere").value(), 10000, 0.0005);
  const std::vector<uint8_t> dss = InParts(points, kBlocks).encoded.Concatenate();
  const OpenedDss file = OpenDss(dss, true).value();
  DisplacedSurface surface = DecodeDss(dss, RunContext{})->surface;
  const FaceVertices vertices(file.topology, surface.max_level);
  std::vector<uint8_t> raised(surface.heights.size(), 0);
  std::vector<int> of_face;
  for (int g = 0; g < file.groups.count(); g += 2) {
    for (const int f : file.groups.members[g]) {
      vertices.Of(f, of_face);
      for (const int v : of_face) raised[v] = 1;
    }
  }
  for (size_t v = 0; v < raised.size(); ++v) surface.heights[v] += raised[v] != 0 ? 1e-4f : 0;
  EncodeOptions options;
  options.group_faces = file.header.group_limit;
  options.position_step = file.header.position_step;
  options.height_step = 1e-6;
  const EncodedSurface stepped = EncodeDss(surface, {}, options, RunContext{}).value();
  EXPECT_GT(MeasureSeams(stepped.Concatenate(), RunContext{})->BendRatio(), 1.2);
}

TEST(PagedScanTest, BlocksStateWhatTheFileShows) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("terrain").value(), 10000, 0.0005);
  const Reconstruction blocks = InParts(points, kBlocks);
  ASSERT_TRUE(blocks.surface.heights.empty()) << "not coded in blocks";
  const DecodedSurface decoded = DecodeDss(blocks.encoded.Concatenate(), RunContext{}).value();
  const Verification verified = VerifyCertificate(decoded, nullptr, RunContext{}).value();
  EXPECT_TRUE(verified.complete);
  EXPECT_EQ(verified.figures.size(), 4u);
  for (const CertifiedFigure& figure : verified.figures) {
    EXPECT_TRUE(figure.agrees) << figure.name << ": " << figure.stated << ", " << figure.found;
  }
  EXPECT_NEAR(decoded.metadata.error_across, blocks.report.error.across_rms,
              1e-3 * blocks.report.error.across_rms);
}

TEST(PagedScanTest, BlocksKeepAnErrorOrASize) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("genus2").value(), 10000);
  ReconstructOptions options;
  options.encode.max_error = 3e-4;
  const Reconstruction exact = InParts(points, kBlocks, options);
  ASSERT_TRUE(exact.surface.heights.empty()) << "not coded in blocks";
  EXPECT_LE(exact.report.error.across_rms, 3e-4);
  EXPECT_GT(exact.report.error.across_rms, 2.5e-4);
  options.encode.max_error.reset();
  options.encode.max_bytes = exact.report.encoded_bytes * 6 / 5;
  const Reconstruction sized = InParts(points, kBlocks, options);
  EXPECT_LE(sized.report.encoded_bytes, *options.encode.max_bytes);
  EXPECT_LT(sized.report.error.across_rms, exact.report.error.across_rms);
}

TEST(PagedScanTest, TheNumberOfThreadsDoesNotChangeAByteOfBlocks) {
  const Eigen::Matrix3Xd points = EvenPoints(*MakeShape("torus").value(), 10000, 0.0005);
  const auto bytes = [&](int threads) {
    return InParts(points, kBlocks, {}, threads).encoded.Concatenate();
  };
  EXPECT_EQ(bytes(1), bytes(3));
}

}  // namespace
}  // namespace rilievo
