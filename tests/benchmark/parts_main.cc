// Scans made by small parts beside the same in memory, as rows of a table.
//
//   rilievo_parts SCAN...
//
// For each scan two rows: parts and blocks that read 20 480 points and code 8 000 vertices, with
// all points in the coarse pass, and with a quarter of them. The error is that across the surface
// against the points that are used in memory.
#include <cstdio>
#include <filesystem>
#include <string>

#include "client/formats/scan_reader.h"
#include "core/base/status_macros.h"
#include "core/paging/scan_pager.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/shape_input.h"

namespace rilievo {
namespace {

constexpr int64_t kPartPoints = 20480, kBlockVertices = 8000;

struct Row {
  double error = 0;
  int64_t bytes = 0;
  ReconstructReport report;
};

absl::StatusOr<Row> RowOf(const Reconstruction& made, const ScanSurface& scan) {
  Row row;
  row.report = made.report;
  row.bytes = made.report.encoded_bytes;
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                           DecodeDss(made.encoded.Concatenate(), RunContext()));
  Shape points = PointsToMeasure(scan.cloud);
  const SpatialFrame& frame = decoded.surface.frame;
  for (auto point : points.vertices.colwise()) {
    point = frame.UnitFromScan(scan.frame.ScanFromUnit(point));
  }
  for (float& gap : points.gaps) gap *= static_cast<float>(scan.frame.diagonal / frame.diagonal);
  RILIEVO_ASSIGN_OR_RETURN(
      const TwoSidedError error,
      MeasureSurface(decoded.surface, FilledVertices(decoded.surface, ControlOptions()), points,
                     RunContext()));
  row.error = error.across_rms * frame.diagonal / scan.frame.diagonal;
  return row;
}

void Print(const std::string& name, const char* coarse, const Row& whole, const Row& parts) {
  const auto topology = [](const ReconstructReport& report) {
    return std::to_string(report.genus) + "/" + std::to_string(report.components) + "/" +
           std::to_string(report.boundary_loops);
  };
  std::printf("| %s | %s | %.4f | %.4f | %.3f | %lld | %lld | %.3f | %s | %s |\n", name.c_str(),
              coarse, 100 * whole.error, 100 * parts.error, parts.error / whole.error,
              static_cast<long long>(whole.bytes), static_cast<long long>(parts.bytes),
              static_cast<double>(parts.bytes) / static_cast<double>(whole.bytes),
              topology(whole.report).c_str(), topology(parts.report).c_str());
  std::fflush(stdout);
}

absl::Status Compare(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile file, ReadScan(path));
  PointCloud cloud;
  cloud.points = file.cloud.points;
  const ReconstructOptions options;
  RILIEVO_ASSIGN_OR_RETURN(const ScanSurface scan, PointsOfScan(cloud, options, RunContext()));
  RILIEVO_ASSIGN_OR_RETURN(const Reconstruction in_memory,
                           Reconstruct(cloud, options, RunContext()));
  RILIEVO_ASSIGN_OR_RETURN(const Row whole, RowOf(in_memory, scan));
  for (const int64_t thinned : {1, 4}) {
    RILIEVO_ASSIGN_OR_RETURN(ScanPager pager,
                             ScanPager::Create(std::filesystem::temp_directory_path().string()));
    RILIEVO_RETURN_IF_ERROR(pager.Add(cloud.points));
    RILIEVO_ASSIGN_OR_RETURN(const PagedScan pages, pager.Finish(RunContext()));
    const PartSizes sizes{cloud.points.cols() / thinned, kPartPoints, kBlockVertices};
    RILIEVO_ASSIGN_OR_RETURN(const Reconstruction made,
                             ReconstructPaged(pages, sizes, options, RunContext()));
    RILIEVO_ASSIGN_OR_RETURN(const Row parts, RowOf(made, scan));
    Print(std::filesystem::path(path).stem().string(), thinned == 1 ? "all" : "a quarter", whole,
          parts);
  }
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: rilievo_parts SCAN...\n");
    return 2;
  }
  std::printf(
      "| scan | coarse pass | error, %% | by parts | ratio | bytes | by parts | ratio | "
      "genus/components/loops | by parts |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- "
      "| "
      "--- |\n");
  int failed = 0;
  for (int i = 1; i < argc; ++i) {
    const absl::Status status = rilievo::Compare(argv[i]);
    if (status.ok()) continue;
    std::fprintf(stderr, "%s: %s\n", argv[i], std::string(status.message()).c_str());
    ++failed;
  }
  return failed == 0 ? 0 : 1;
}
