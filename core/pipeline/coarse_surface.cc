#include "core/pipeline/coarse_surface.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/control/build_control_mesh.h"
#include "core/control/choose_topology.h"
#include "core/loop/refinement.h"
#include "core/paging/scratch_heights.h"
#include "core/pipeline/fit_domain.h"
#include "core/pipeline/option_lengths.h"
#include "core/pipeline/pages_to_thin.h"
#include "core/pipeline/run_parts.h"
#include "core/pipeline/settings.h"
#include "core/pipeline/shape_input.h"
#include "core/surface/stored_surface.h"

namespace rilievo {
namespace {

constexpr char kCoarseName[] = "coarse";

// TellingPoints() of all points, of which the cloud is a sample.
int64_t TellingOfPages(const PagedScan& pages, const OrientedCloud& cloud,
                       const PointMedians& medians) {
  return TellingPoints(cloud, pages.size(), std::min(1.0, medians.spacing / cloud.median_spacing));
}

// As many control faces as suit all points, as far as the `thinned` ones show their shape: they are
// fitted to all.
ReconstructOptions WithFacesForPages(ReconstructOptions options, int64_t thinned, int64_t telling) {
  options.control.target_faces = static_cast<int>(std::clamp<int64_t>(
      thinned / kCoarseSurface.thinned_per_face, 1, DefaultControlFaces(telling)));
  return options;
}

// Heights of thinned points tell how far the surface reaches, no more: one level less than they
// would allow.
ReconstructOptions AtCoarseLevel(ReconstructOptions options, const OrientedCloud& thinned,
                                 int64_t control_faces) {
  const auto points = static_cast<double>(thinned.points.cols());
  options.max_level = LevelAsDenseAs(points / kCoarseSurface.points_per_vertex, control_faces);
  return options;
}

CoarseSurface NoSurface() {
  PointIndex index(Eigen::Matrix3Xd::Zero(3, 1));
  return {ScanSurface{{}, {}, {}, std::move(index), {}, {}}, {}, {}, {}, {}};
}

// Where the options leave the topology open, whether it is arbitrary by the spacing of all points:
// steps and gaps that thinned ones do not show count too. The reason; empty: the thinned ones may
// choose.
absl::StatusOr<std::string> ReasonForArbitrary(double spacing, const ControlOptions& options,
                                               const RunContext& context, OrientedCloud* thinned) {
  if (options.topology != Topology::kAuto || options.user_mesh) return std::string();
  const double own = std::exchange(thinned->median_spacing, spacing);
  const absl::StatusOr<TopologyChoice> choice = ChooseTopology(*thinned, context);
  thinned->median_spacing = own;
  RILIEVO_RETURN_IF_ERROR(choice.status());
  return choice->topology == Topology::kArbitrary ? choice->reason : std::string();
}

absl::StatusOr<ShapedInput> ShapeAnalyzed(ScanSurface scan, double spacing, bool is_thinned,
                                          const ReconstructOptions& options,
                                          const PipelineContext& context) {
  if (!is_thinned) return ShapePoints(std::move(scan), "", options, context);
  scan.cloud.share_of_spacing = std::min(1.0, spacing / scan.cloud.median_spacing);
  RILIEVO_ASSIGN_OR_RETURN(
      const std::string reason,
      ReasonForArbitrary(spacing, options.control, context.Silent(), &scan.cloud));
  if (reason.empty()) return ShapePoints(std::move(scan), "", options, context);
  ReconstructOptions arbitrary = options;
  arbitrary.control.topology = Topology::kArbitrary;
  RILIEVO_ASSIGN_OR_RETURN(ShapedInput input, ShapePoints(std::move(scan), "", arbitrary, context));
  input.options.control.topology = options.control.topology;
  input.control.reason = reason;
  return input;
}

absl::StatusOr<CoarseSurface> ShapeThinned(const PagedScan& pages, int64_t coarse_points,
                                           const std::vector<bool>& left_out,
                                           const ReconstructOptions& given,
                                           const PipelineContext& context) {
  CoarseSurface coarse = NoSurface();
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface scan, AnalyzeThinned(pages, coarse_points, left_out, given,
                                                            context, &coarse.all_points));
  const bool faces_given = given.control.target_faces > 0 || given.control.user_mesh;
  const int64_t count = std::min(pages.size(), coarse_points);
  const ReconstructOptions asked =
      faces_given || count == pages.size()
          ? given
          : WithFacesForPages(given, count, TellingOfPages(pages, scan.cloud, coarse.all_points));
  const double spacing = coarse.all_points.spacing;
  RILIEVO_ASSIGN_OR_RETURN(ShapedInput input, ShapeAnalyzed(std::move(scan), spacing,
                                                            count < pages.size(), asked, context));
  coarse.scan = std::move(input.scan);
  const ReconstructOptions& options = coarse.options = std::move(input.options);
  RILIEVO_ASSIGN_OR_RETURN(
      Domain domain,
      faces_given ? FitDomain(coarse.scan, input.control.mesh, options, context)
                  : FitFewFaces(coarse.scan, spacing, {}, input.control.mesh, options, context));
  const ReconstructOptions at_level =
      AtCoarseLevel(options, coarse.scan.cloud, domain.fit.control_mesh.faces.cols());
  RILIEVO_ASSIGN_OR_RETURN(coarse.sampled, SampleHeights(coarse.scan, input.control.topology,
                                                         std::move(domain), at_level, context));
  coarse.sampled.shape = {};
  coarse.control.topology = input.control.topology;
  coarse.control.reason = std::move(input.control.reason);
  return coarse;
}

template <typename Archive, typename Mesh>
void VisitMesh(Archive& archive, Mesh& mesh) {
  archive(mesh.vertices);
  archive(mesh.faces);
  archive(mesh.creases);
  archive(mesh.corners);
  archive(mesh.diagonals);
}

template <typename Archive, typename Surface>
void VisitCoarse(Archive& archive, Surface& coarse) {
  archive(coarse.scan.frame.center);
  archive(coarse.scan.frame.diagonal);
  archive(coarse.scan.figures);
  auto& cloud = coarse.scan.cloud;
  archive(cloud.points);
  archive(cloud.normals);
  archive(cloud.spacing);
  archive(cloud.noise);
  archive(cloud.ambiguous);
  archive(cloud.sharp_lines);
  archive(cloud.median_spacing);
  archive(cloud.median_noise);
  archive(coarse.control.topology);
  archive(coarse.control.reason);
  archive(coarse.options.control.target_faces);
  archive(coarse.all_points.spacing);
  archive(coarse.all_points.noise);
  auto& domain = coarse.sampled.domain;
  VisitMesh(archive, domain.fit.control_mesh);
  archive(domain.fit.rms_before);
  archive(domain.fit.rms_after);
  archive(domain.fit.rounds);
  archive(domain.fit.converged);
  archive(domain.fit.round_rms);
  archive(domain.position_step);
  archive(domain.is_filled);
  archive(coarse.sampled.leverage);
  auto& surface = coarse.sampled.surface;
  VisitMesh(archive, surface.control_mesh);
  archive(surface.max_level);
  archive(surface.heights);
  archive(surface.sources);
}

std::vector<uint8_t> Saved(const CoarseSurface& coarse) {
  ValueWriter writer;
  VisitCoarse(writer, coarse);
  return std::move(writer.bytes);
}

bool IsWholeMesh(const ControlMesh& mesh) {
  return mesh.vertices.allFinite() && PartCutter::Make(mesh).ok();
}

// Whether indices and counts fit each other: a checksum does not tell who wrote the bytes.
bool IsConsistent(const CoarseSurface& coarse) {
  const OrientedCloud& cloud = coarse.scan.cloud;
  const auto points = static_cast<size_t>(cloud.points.cols());
  const auto is_of_points = [&](size_t count) { return count == points; };
  if (points == 0 || !cloud.points.allFinite() || !cloud.normals.allFinite() ||
      !is_of_points(static_cast<size_t>(cloud.normals.cols())) ||
      !is_of_points(cloud.spacing.size()) || !is_of_points(cloud.noise.size()) ||
      !(cloud.ambiguous.empty() || is_of_points(cloud.ambiguous.size())) ||
      cloud.sharp_lines.cols() % 2 != 0) {
    return false;
  }
  const SpatialFrame& frame = coarse.scan.frame;
  const DisplacedSurface& surface = coarse.sampled.surface;
  const PointMedians& medians = coarse.all_points;
  if (!(medians.spacing > 0) || !std::isfinite(medians.spacing) || !(medians.noise >= 0) ||
      !std::isfinite(medians.noise) || !(coarse.sampled.leverage > 0) ||
      !(coarse.sampled.leverage <= 1)) {
    return false;
  }
  if (!frame.center.allFinite() || !std::isfinite(frame.diagonal) || frame.diagonal <= 0 ||
      coarse.control.topology < Topology::kAuto || coarse.control.topology > Topology::kMesh ||
      surface.max_level < 0 || surface.max_level > kMaxLoopLevel ||
      !IsWholeMesh(coarse.sampled.domain.fit.control_mesh) || !IsWholeMesh(surface.control_mesh)) {
    return false;
  }
  const int64_t vertices =
      VertexCountAt(PartCutter::Make(surface.control_mesh)->topology(), surface.max_level);
  return static_cast<int64_t>(surface.heights.size()) == vertices &&
         surface.sources.size() == surface.heights.size() && AreSources(surface.sources) &&
         std::all_of(surface.heights.begin(), surface.heights.end(),
                     [](float height) { return std::isfinite(height); });
}

// Unset where the bytes are not those of one.
absl::StatusOr<std::optional<CoarseSurface>> CoarseOf(std::span<const uint8_t> bytes,
                                                      const ReconstructOptions& given) {
  CoarseSurface coarse = NoSurface();
  coarse.options = given;
  ValueReader reader(bytes);
  VisitCoarse(reader, coarse);
  if (!reader.Finished() || !IsConsistent(coarse)) return std::nullopt;
  RILIEVO_ASSIGN_OR_RETURN(coarse.options,
                           WithoutLengths(std::move(coarse.options), coarse.scan.frame.diagonal));
  coarse.sampled.surface.frame = coarse.scan.frame;
  return coarse;
}

absl::StatusOr<CoarseSurface> ShapeForAll(const PagedScan& pages, int64_t coarse_points,
                                          const ReconstructOptions& given, SharedParts* shared,
                                          const PipelineContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<bool> left_out,
                           LeftOutOfThinned(pages, coarse_points, given, shared, context));
  std::optional<CoarseSurface> coarse;
  PartsOfStep step{.step = PartStep::kCoarse, .count = 1};
  step.make = [&](int /*part*/,
                  const RunContext& /*context*/) -> absl::StatusOr<std::vector<uint8_t>> {
    RILIEVO_ASSIGN_OR_RETURN(const CoarseSurface made,
                             ShapeThinned(pages, coarse_points, left_out, given, context));
    return Saved(made);
  };
  step.take = [&](int part, std::span<const uint8_t> bytes) -> absl::Status {
    RILIEVO_ASSIGN_OR_RETURN(coarse, CoarseOf(bytes, given));
    return coarse ? absl::OkStatus() : NotOfPart(PartStep::kCoarse, part);
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(step, {[](double /*share*/) {}, shared}, context));
  return *std::move(coarse);
}

absl::StatusOr<CoarseSurface> FindOrShape(const PagedScan& pages, int64_t coarse_points,
                                          const ReconstructOptions& given,
                                          const PipelineContext& context) {
  const ScratchFolder& folder = pages.scratch_folder();
  if (const auto saved = folder.Load(kCoarseName)) {
    RILIEVO_ASSIGN_OR_RETURN(std::optional<CoarseSurface> found, CoarseOf(*saved, given));
    if (found) return *std::move(found);
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<bool> left_out,
                           LeftOutOfThinned(pages, coarse_points, given, nullptr, context));
  RILIEVO_ASSIGN_OR_RETURN(CoarseSurface made,
                           ShapeThinned(pages, coarse_points, left_out, given, context));
  if (folder.keeps()) RILIEVO_RETURN_IF_ERROR(folder.Save(kCoarseName, Saved(made)));
  return made;
}

}  // namespace

absl::StatusOr<std::vector<bool>> LeftOutOfThinned(const PagedScan& pages, int64_t coarse_points,
                                                   const ReconstructOptions& options,
                                                   SharedParts* shared,
                                                   const PipelineContext& context) {
  if (pages.size() <= coarse_points) return std::vector<bool>();
  const StageScope scope(Stage::kCheck, context);
  const auto told = [&context](double share) { context.Report(Stage::kCheck, share); };
  return LeftOutOfPages(pages, options, {told, shared}, context.Silent());
}

absl::StatusOr<ScanSurface> AnalyzeThinned(const PagedScan& pages, int64_t coarse_points,
                                           const std::vector<bool>& left_out,
                                           const ReconstructOptions& options,
                                           const PipelineContext& context, PointMedians* medians) {
  const bool is_thinned = pages.size() > coarse_points;
  ReconstructOptions of_thinned = options;
  PointCloud thinned;
  if (is_thinned) of_thinned.scan.outliers.distance_factor = 0;
  RILIEVO_ASSIGN_OR_RETURN(thinned.points, pages.Thinned(coarse_points, left_out, context));
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface scan, AnalyzeInput(thinned, &thinned, of_thinned, context));
  *medians = {scan.cloud.median_spacing, scan.cloud.median_noise};
  if (!is_thinned) return scan;
  RILIEVO_ASSIGN_OR_RETURN(*medians, MediansOfPages(pages, scan, options, context.Silent()));
  if (medians->noise > medians->spacing) {
    const int64_t telling = TellingOfPages(pages, scan.cloud, *medians);
    { const ScanSurface spent = std::move(scan); }
    RILIEVO_ASSIGN_OR_RETURN(
        thinned.points,
        pages.Sampled(std::min(coarse_points, kCoarseSurface.sampled_of_telling * telling),
                      left_out, context));
    RILIEVO_ASSIGN_OR_RETURN(scan, AnalyzeInput(thinned, &thinned, of_thinned, context));
    medians->noise = scan.cloud.median_noise;  // which fewer points tell better
    return scan;
  }
  OrientedCloud& cloud = scan.cloud;
  if (medians->noise < cloud.median_noise) {
    const auto share = static_cast<float>(medians->noise / cloud.median_noise);
    for (float& noise : cloud.noise) noise *= share;
    cloud.median_noise = medians->noise;
  }
  return scan;
}

absl::StatusOr<CoarseSurface> ShapeCoarsely(const PagedScan& pages, int64_t coarse_points,
                                            const ReconstructOptions& given, SharedParts* shared,
                                            const PipelineContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(CoarseSurface coarse,
                           shared != nullptr
                               ? ShapeForAll(pages, coarse_points, given, shared, context)
                               : FindOrShape(pages, coarse_points, given, context));
  // Of points equally far off it depends on the index which is nearest: it is made in one way.
  ScanSurface& scan = coarse.scan;
  scan.graph = NeighborGraph();
  RILIEVO_ASSIGN_OR_RETURN(scan.index, PointIndex::BuildOver(scan.cloud.points, context));
  return coarse;
}

}  // namespace rilievo
