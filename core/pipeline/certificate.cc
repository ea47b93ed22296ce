#include "core/pipeline/certificate.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/run_concurrently.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "core/meshes/check_mesh.h"
#include "core/pipeline/compact_parts.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/shape_input.h"
#include "core/points/settings.h"
#include "core/scan/scan_surface.h"
#include "core/surface/heights_in_memory.h"
#include "core/surface/part_triangles.h"
#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

static_assert(std::endian::native == std::endian::little, "hashes are over little-endian doubles");

DssDistance Distance(const DistanceSummary& summary) {
  return {summary.rms, summary.mean, summary.p95, summary.max};
}

// The points or the triangles that the errors of the file are about.
absl::StatusOr<Shape> PointsUsed(const PointCloud& scan, const StatedOptions& stated,
                                 const SpatialFrame& frame, const RunContext& context) {
  Shape points;
  SpatialFrame cleaned;
  if (scan.triangles.cols() > 0) {
    RILIEVO_ASSIGN_OR_RETURN(CheckedMesh mesh, CheckMesh(scan, context));
    points = {std::move(mesh.vertices), std::move(mesh.triangles)};
    cleaned = mesh.frame;
  } else {
    RILIEVO_ASSIGN_OR_RETURN(ScanSurface surface, PointsOfScan(scan, stated.options, context));
    points = PointsToMeasure(std::move(surface.cloud));
    cleaned = surface.frame;
  }
  if (cleaned.center == frame.center && cleaned.diagonal == frame.diagonal) return points;
  for (auto point : points.vertices.colwise()) {
    point = frame.UnitFromScan(cleaned.ScanFromUnit(point));
  }
  const auto scale = static_cast<float>(cleaned.diagonal / frame.diagonal);
  for (float& gap : points.gaps) gap *= scale;
  return points;
}

// Counted in parts, whose limit surfaces take little memory; in few, for to cut one all faces are
// looked at.
absl::StatusOr<int64_t> CountFoldsOf(const DisplacedSurface& surface, const RunContext& context) {
  constexpr int64_t kVerticesAtOnce = 1 << 16, kMostParts = 64;
  const ControlMesh& mesh = surface.control_mesh;
  RILIEVO_ASSIGN_OR_RETURN(const PartCutter cutter, PartCutter::Make(mesh));
  const MeshTopology& topology = cutter.topology();
  const HeightsInMemory heights(surface, topology);
  const StoredSurface stored = Stored(surface, heights);
  const int64_t faces = topology.face_count();
  const int64_t at_once = std::max(kVerticesAtOnce * faces / std::ssize(surface.heights),
                                   (faces + kMostParts - 1) / kMostParts);
  int64_t folds = 0;
  for (const std::vector<int>& part : CompactParts(mesh, topology, at_once)) {
    RILIEVO_ASSIGN_OR_RETURN(const SurfacePart cut, ReadPart(stored, cutter, part, 0));
    RILIEVO_ASSIGN_OR_RETURN(const PartTriangles triangles, TrianglesOfPart(cut, context));
    folds += triangles.folds;
  }
  return folds;
}

class FigureList {
 public:
  void Add(std::string name, double stated, double found) {
    if (stated < 0) return;
    const bool agrees = std::abs(stated - found) <=
                        kCertificate.relative * std::max(stated, found) + kCertificate.absolute;
    figures.push_back({std::move(name), stated, found, agrees});
  }
  void Add(const std::string& name, const DssDistance& stated, const DssDistance& found) {
    Add(name + "_rms", stated.rms, found.rms);
    Add(name + "_mean", stated.mean, found.mean);
    Add(name + "_p95", stated.p95, found.p95);
    Add(name + "_max", stated.max, found.max);
  }
  std::vector<CertifiedFigure> figures;
};

}  // namespace

std::vector<CertifiedFigure> CompareFigures(const DssMetadata& stated, const DssMetadata& found,
                                            bool with_errors) {
  FigureList list;
  if (with_errors) {
    list.Add("scan_to_surface", stated.scan_to_surface, found.scan_to_surface);
    list.Add("rms", stated.error_rms, found.error_rms);
    list.Add("mean", stated.error_mean, found.error_mean);
    list.Add("p95", stated.error_p95, found.error_p95);
    list.Add("max", stated.error_max, found.error_max);
    list.Add("rms_across", stated.error_across, found.error_across);
    list.Add("surface_to_scan", stated.surface_to_scan, found.surface_to_scan);
    list.Add("scan_points", static_cast<double>(stated.scan_points),
             static_cast<double>(found.scan_points));
  }
  list.Add("folds", static_cast<double>(stated.folds), static_cast<double>(found.folds));
  if (stated.filled_share >= 0) {
    list.Add("filled_share", stated.filled_share, found.filled_share);
    list.Add("smoothed_share", stated.smoothed_share, found.smoothed_share);
    const double shares = stated.measured_share + stated.smoothed_share + stated.filled_share;
    list.Add("sum_of_shares", shares, 1.0);
  }
  return std::move(list.figures);
}

std::string HashOfScan(const PointCloud& scan) {
  constexpr size_t kBlock = 4096;
  Sha256 hash;
  std::array<double, kBlock> block;
  const double* coordinates = scan.points.data();
  const size_t count = static_cast<size_t>(scan.points.size());
  for (size_t begin = 0; begin < count; begin += kBlock) {
    const size_t n = std::min(kBlock, count - begin);
    std::transform(coordinates + begin, coordinates + begin + n, block.begin(), [](double x) {
      return std::isnan(x) ? std::numeric_limits<double>::quiet_NaN() : x;
    });
    hash.Add({reinterpret_cast<const uint8_t*>(block.data()), n * sizeof(double)});
  }
  hash.Add({reinterpret_cast<const uint8_t*>(scan.triangles.data()),
            static_cast<size_t>(scan.triangles.size()) * sizeof(int)});
  const auto digest = hash.Finish();
  return std::string(digest.begin(), digest.begin() + kHashBytes);
}

std::vector<uint8_t> FilledVertices(const DisplacedSurface& surface,
                                    const ControlOptions& control) {
  std::vector<uint8_t> filled;
  if (!control.fills_holes()) return filled;
  filled.reserve(surface.sources.size());
  for (const HeightSource source : surface.sources) {
    filled.push_back(source == HeightSource::kFilled ? 1 : 0);
  }
  return filled;
}

absl::StatusOr<Shape> FinestTriangles(const DisplacedSurface& surface, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      TriangleMesh mesh,
      TessellateInUnitFrame(surface, surface.max_level, /*with_normals=*/false, context));
  Shape shape{std::move(mesh.vertices), std::move(mesh.triangles)};
  shape.children_per_face = 1 << (2 * surface.max_level);
  return shape;
}

absl::StatusOr<TwoSidedError> MeasureSurface(const DisplacedSurface& surface,
                                             std::vector<uint8_t> filled, const Shape& points,
                                             const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(Shape triangles, FinestTriangles(surface, context));
  triangles.filled = std::move(filled);
  return MeasureTriangles(triangles, points, context);
}

absl::StatusOr<TwoSidedError> MeasureSurface(const DisplacedSurface& surface,
                                             std::vector<uint8_t> filled,
                                             const SearchableShape& points,
                                             const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(Shape triangles, FinestTriangles(surface, context));
  triangles.filled = std::move(filled);
  return MeasureAgainst(triangles, points, MeasureOptions{kCertificate.certified_samples}, context);
}

absl::StatusOr<TwoSidedError> MeasureTriangles(const Shape& surface, const Shape& points,
                                               const RunContext& context) {
  return MeasureTwoSided(surface, points, MeasureOptions{kCertificate.certified_samples}, context);
}

Shape ShapeToMeasure(const OrientedCloud& cloud, const Shape& mesh) {
  return mesh.triangles.cols() > 0 ? mesh : PointsToMeasure(cloud);
}

Shape PointsToMeasure(OrientedCloud cloud) {
  for (float& gap : cloud.spacing) gap *= static_cast<float>(kCommon.gap_spacings);
  return {std::move(cloud.points), {}, std::move(cloud.spacing), std::move(cloud.normals)};
}

double ShareOf(HeightSource source, const DisplacedSurface& surface) {
  return static_cast<double>(std::count(surface.sources.begin(), surface.sources.end(), source)) /
         static_cast<double>(std::max<size_t>(1, surface.sources.size()));
}

void StateErrors(const TwoSidedError& error, DssMetadata* metadata) {
  metadata->error_rms = error.rms;
  metadata->error_mean = error.mean;
  metadata->error_p95 = error.p95;
  metadata->error_max = error.max;
  metadata->error_across = error.across_rms;
  metadata->surface_to_scan = Distance(error.a_to_b);
  metadata->scan_to_surface = Distance(error.b_to_a);
}

// Few smoothed heights leave no flags in the file, and files written before there were any have
// none: then the maker's word stands.
void StateShares(double filled, double smoothed, DssMetadata* metadata) {
  metadata->filled_share = filled;
  if (smoothed == 0) smoothed = std::clamp(metadata->smoothed_share, 0.0, 1 - filled);
  metadata->smoothed_share = smoothed;
  metadata->measured_share = 1 - filled - smoothed;
}

absl::StatusOr<Certificate> CertifySurface(const DisplacedSurface& decoded,
                                           const SearchableShape* points, DssMetadata stated,
                                           const PipelineContext& context) {
  const StageScope scope(Stage::kMeasure, context);
  Certificate certificate{std::move(stated), {}};
  DssMetadata& metadata = certificate.metadata;
  TwoSidedError& error = certificate.error;
  RILIEVO_ASSIGN_OR_RETURN(Shape triangles, FinestTriangles(decoded, context));
  ReleaseToOsAfter(context.points);  // what the refinement took
  const auto count_folds = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(metadata.folds, CountFoldsOf(decoded, context));
    return absl::OkStatus();
  };
  const auto measure = [&]() -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(
        error, MeasureAgainst(triangles, *points, MeasureOptions{kCertificate.certified_samples},
                              context));
    return absl::OkStatus();
  };
  if (points == nullptr) {
    RILIEVO_RETURN_IF_ERROR(count_folds());
  } else {
    RILIEVO_ASSIGN_OR_RETURN(const StatedOptions asked, ReadOptionsText(metadata.options));
    triangles.filled = FilledVertices(decoded, asked.options.control);
    RILIEVO_RETURN_IF_ERROR(RunConcurrently(context, measure, count_folds));
    StateErrors(error, &metadata);
  }
  StateShares(ShareOf(HeightSource::kFilled, decoded), ShareOf(HeightSource::kSmoothed, decoded),
              &metadata);
  return certificate;
}

absl::StatusOr<CertifiedBytes> Certify(EncodedSurface encoded, const DssMetadata& metadata,
                                       std::optional<Shape> points,
                                       const PipelineContext& context) {
  const PipelineContext silent = context.Silent();  // progress has passed this stage
  DecodedSurface decoded;
  std::optional<SearchableShape> searchable;
  const auto decode = [&]() -> absl::Status {
    const StageScope scope(Stage::kMeasure, silent);
    RILIEVO_ASSIGN_OR_RETURN(decoded, DecodeDss(encoded.Concatenate(), silent));
    return absl::OkStatus();
  };
  const auto make_tree = [&]() -> absl::Status {
    if (!points) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(searchable, MakeSearchable(*std::move(points), silent));
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunConcurrently(silent, decode, make_tree));
  RILIEVO_ASSIGN_OR_RETURN(
      const Certificate certificate,
      CertifySurface(decoded.surface, searchable ? &*searchable : nullptr, metadata, silent));
  RILIEVO_RETURN_IF_ERROR(ReplaceMetadata(certificate.metadata, encoded));
  return CertifiedBytes{std::move(encoded), certificate.error};
}

bool Verification::agrees() const {
  if (!complete || scan == StatedScan::kOther || scan == StatedScan::kUnknown) return false;
  return !figures.empty() && std::all_of(figures.begin(), figures.end(),
                                         [](const CertifiedFigure& f) { return f.agrees; });
}

absl::StatusOr<Verification> VerifyCertificate(const DecodedSurface& decoded,
                                               const PointCloud* scan, const RunContext& context) {
  const absl::StatusOr<StatedOptions> asked = ReadOptionsText(decoded.metadata.options);
  if (scan != nullptr && asked.ok() && asked->parts) {
    return absl::InvalidArgumentError(
        "the surface was made by parts, and its errors are those of the points as parts find "
        "them: verify it by parts");
  }
  Verification verification;
  verification.complete =
      decoded.surface.max_level == decoded.declared_max_level && decoded.chunk_bytes.size() > 1;
  if (scan != nullptr) {
    // Files of older versions state more of the hash.
    const std::string stated = decoded.metadata.input_hash.substr(0, kHashBytes);
    verification.scan = stated.empty()                ? StatedScan::kUnknown
                        : HashOfScan(*scan) == stated ? StatedScan::kSame
                                                      : StatedScan::kOther;
  }
  DssMetadata stated = decoded.metadata;
  const bool with_errors = verification.scan == StatedScan::kSame;
  PipelineContext measure{context, nullptr, scan != nullptr ? scan->points.cols() : 0};
  std::optional<SearchableShape> points;
  if (with_errors) {
    RILIEVO_RETURN_IF_ERROR(asked.status());
    measure.seed = asked->seed;
    stated.scan_points = scan->points.cols();
    if (decoded.metadata.error_rms >= 0) {
      RILIEVO_ASSIGN_OR_RETURN(Shape used,
                               PointsUsed(*scan, *asked, decoded.surface.frame, measure));
      RILIEVO_ASSIGN_OR_RETURN(points, MakeSearchable(std::move(used), measure));
    }
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const Certificate found,
      CertifySurface(decoded.surface, points ? &*points : nullptr, stated, measure));
  verification.figures = CompareFigures(decoded.metadata, found.metadata, with_errors);
  return verification;
}

}  // namespace rilievo
