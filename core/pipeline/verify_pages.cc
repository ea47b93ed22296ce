#include "core/pipeline/verify_pages.h"

#include <optional>
#include <utility>
#include <vector>

#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "core/codec/container/height_update.h"
#include "core/codec/container/open_dss.h"
#include "core/pipeline/analyze_pages.h"
#include "core/pipeline/coarse_surface.h"
#include "core/pipeline/code_stored_surface.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/points_of_pages.h"
#include "core/pipeline/safely.h"

namespace rilievo {
namespace {

// All points as the parts of a reconstruction find them, but for their sides, which a control mesh
// may turn and on which no error depends.
absl::StatusOr<AnalyzedPages> AnalyzeAgain(const PagedScan& scan, const PartSizes& sizes,
                                           const ReconstructOptions& options,
                                           const PipelineContext& context, SpatialFrame* frame) {
  PointMedians medians;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<bool> left_out,
                           LeftOutOfThinned(scan, sizes.coarse_points, options, nullptr, context));
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface thinned, AnalyzeThinned(scan, sizes.coarse_points, left_out,
                                                               options, context, &medians));
  thinned.graph = NeighborGraph();
  RILIEVO_ASSIGN_OR_RETURN(thinned.index, PointIndex::BuildOver(thinned.cloud.points, context));
  *frame = thinned.frame;
  const auto told = [&context](double share) { context.Report(Stage::kNormals, share); };
  return AnalyzePages(scan, thinned, sizes.part_points, options, {told}, context.Silent());
}

}  // namespace

absl::StatusOr<std::string> HashOfPages(const PagedScan& scan, const RunContext& context) {
  Sha256 hash;
  for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, scan.Read(page));
    hash.Add({reinterpret_cast<const uint8_t*>(points.data()),
              static_cast<size_t>(points.size()) * sizeof(double)});
  }
  const auto digest = hash.Finish();
  return std::string(digest.begin(), digest.begin() + kHashBytes);
}

namespace {

absl::StatusOr<Verification> Verify(std::span<const uint8_t> dss, const PagedScan& scan,
                                    const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenDss(dss, true));
  RILIEVO_RETURN_IF_ERROR(CheckHeightLaw(file));
  RILIEVO_ASSIGN_OR_RETURN(const DssMetadata stated, MetadataWithUpdates(file));
  RILIEVO_ASSIGN_OR_RETURN(const StatedOptions asked, ReadOptionsText(stated.options));
  ReconstructOptions in_range = asked.options;
  in_range.control.topology = Topology::kAuto;  // a given mesh is named and not repeated
  RILIEVO_RETURN_IF_ERROR(in_range.Validate());
  const PartSizes sizes = asked.parts.value_or(PartSizes{});
  RILIEVO_RETURN_IF_ERROR(sizes.Validate());
  if (!asked.parts && !stated.input_hash.empty()) {
    return absl::InvalidArgumentError(
        "the surface was not made by parts, and its errors are those of the points as they are "
        "found in memory: verify it without parts");
  }
  Verification verification;
  verification.complete = file.whole() && file.chunk_bytes.size() > 1;
  RILIEVO_ASSIGN_OR_RETURN(const std::string hash, HashOfPages(scan, context));
  const bool same = hash == stated.input_hash;
  verification.scan = stated.input_hash.empty() ? StatedScan::kUnknown
                      : same                    ? StatedScan::kSame
                                                : StatedScan::kOther;

  PipelineContext measure{context, nullptr, scan.size()};
  measure.seed = asked.seed;
  std::optional<AnalyzedPages> analyzed;
  std::optional<PointsOfPages> points;
  if (same && stated.error_rms >= 0) {
    SpatialFrame frame;
    RILIEVO_ASSIGN_OR_RETURN(analyzed, AnalyzeAgain(scan, sizes, asked.options, measure, &frame));
    RILIEVO_ASSIGN_OR_RETURN(PointsOfPages of_surface,
                             PointsOfPages::Create(scan, analyzed->surfels, frame));
    points.emplace(std::move(of_surface));
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const PartsError error,
      MeasureDssByParts(dss, sizes, points ? &*points : nullptr, asked.options, measure));
  DssMetadata found = stated;
  if (same) found.scan_points = scan.figures().points_in;
  if (points) StateErrors(error.error, &found);
  found.folds = error.folds;
  StateShares(ShareOfSource(HeightSource::kFilled, error.source_counts),
              ShareOfSource(HeightSource::kSmoothed, error.source_counts), &found);
  verification.figures = CompareFigures(stated, found, same);
  return verification;
}

}  // namespace

absl::StatusOr<Verification> VerifyPaged(std::span<const uint8_t> dss, const PagedScan& scan,
                                         const RunContext& context) {
  return Safely([&] { return Verify(dss, scan, context); });
}

}  // namespace rilievo
