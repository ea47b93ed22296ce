#include "server/conversion/convert_place.h"
#include "server/conversion/job_report.h"

namespace rilievo {
namespace {

void Convert(const DistanceSummary& from, v1::DistanceSummary* to) {
  to->set_rms(from.rms);
  to->set_mean(from.mean);
  to->set_p95(from.p95);
  to->set_max(from.max);
  to->set_samples(from.samples);
}

void Convert(const TwoSidedError& from, v1::TwoSidedError* to) {
  Convert(from.a_to_b, to->mutable_surface_to_points());
  Convert(from.b_to_a, to->mutable_points_to_surface());
  to->set_rms(from.rms);
  to->set_mean(from.mean);
  to->set_p95(from.p95);
  to->set_max(from.max);
  to->set_rms_across(from.across_rms);
}

void Convert(const SightFigures& from, v1::SightReport* to) {
  to->set_points(from.points);
  to->set_usable(from.usable);
  to->set_alignment(from.alignment);
  to->set_consistency(from.consistency);
  to->set_used(from.used);
}

void Convert(const MeshFigures& from, v1::MeshReport* to) {
  to->set_triangles(from.triangles);
  to->set_welded_vertices(from.welded_vertices);
  to->set_dropped(from.dropped);
  to->set_flipped(from.flipped);
  to->set_opened_edges(from.opened_edges);
  to->set_triangles_used(from.triangles_used);
}

void ConvertScan(const ReconstructReport& from, v1::ReconstructReport* to) {
  to->set_points_in(from.points_in);
  to->set_non_finite(from.non_finite);
  to->set_duplicates(from.duplicates);
  to->set_strays(from.strays);
  to->set_outliers(from.outliers);
  to->set_island_points(from.island_points);
  to->set_foliage_points(from.foliage_points);
  to->set_points_used(from.points_used);
  if (from.mesh.triangles > 0) Convert(from.mesh, to->mutable_mesh());
  to->set_diagonal(from.diagonal);
  if (from.place != ScanPlace()) *to->mutable_place() = ProtoPlace(from.place);
  to->set_median_spacing_ratio(from.median_spacing);
  to->set_median_noise_ratio(from.median_noise);
  to->set_normal_disagreement(from.normal_disagreement);
  if (from.stations.points > 0) Convert(from.stations, to->mutable_stations());
  if (from.normals.points > 0) Convert(from.normals, to->mutable_normals());
}

void ConvertSurface(const ReconstructReport& from, v1::ReconstructReport* to) {
  to->set_road(from.topology);
  to->set_road_reason(from.topology_reason);
  to->set_components(from.components);
  to->set_boundary_loops(from.boundary_loops);
  to->set_genus(from.genus);
  to->set_control_vertices(from.control_vertices);
  to->set_control_faces(from.control_faces);
  to->set_max_level(from.max_level);
  to->set_surface_vertices(from.surface_vertices);
  to->set_surface_faces(from.surface_faces);
  to->set_domain_rms_ratio(from.domain_rms);
  to->set_fit_rounds(from.fit_rounds);
  to->set_fit_converged(from.fit_converged);
  to->set_heights_measured(from.heights_measured);
  to->set_heights_smoothed(from.heights_smoothed);
  to->set_heights_filled(from.heights_filled);
  if (from.color_bytes > 0) {
    to->mutable_colors()->set_bytes(from.color_bytes);
    to->mutable_colors()->set_rms(from.color_rms);
  }
}

}  // namespace

v1::Stage ProtoStage(Stage stage) {
  switch (stage) {
    case Stage::kCheck:
      return v1::STAGE_CHECK;
    case Stage::kNeighbors:
      return v1::STAGE_NEIGHBORS;
    case Stage::kNormals:
      return v1::STAGE_NORMALS;
    case Stage::kControlMesh:
      return v1::STAGE_CONTROL_MESH;
    case Stage::kDomainFit:
      return v1::STAGE_DOMAIN_FIT;
    case Stage::kDisplacement:
      return v1::STAGE_DISPLACEMENT;
    case Stage::kEncode:
      return v1::STAGE_ENCODE;
    case Stage::kMeasure:
      return v1::STAGE_MEASURE;
  }
  return v1::STAGE_UNSPECIFIED;
}

v1::ReconstructReport ProtoReport(const ReconstructReport& report, bool measured) {
  v1::ReconstructReport result;
  ConvertScan(report, &result);
  ConvertSurface(report, &result);
  if (measured) Convert(report.error, result.mutable_error());
  if (report.max_error > 0 && measured) result.set_max_error_kept(!report.error_unreachable);
  result.set_encoded_bytes(report.encoded_bytes);
  for (int stage = 0; stage < kStageCount; ++stage) {
    auto* time = result.add_stage_times();
    time->set_stage(ProtoStage(static_cast<Stage>(stage)));
    time->set_seconds(report.stage_seconds[stage]);
  }
  result.set_total_seconds(report.total_seconds);
  for (const std::string& warning : report.warnings) result.add_warnings(warning);
  return result;
}

v1::ReconstructReport ProtoReport(const UpdateReport& report, int64_t bytes) {
  v1::ReconstructReport result;
  result.set_points_in(report.points + report.non_finite);
  result.set_non_finite(report.non_finite);
  result.set_encoded_bytes(bytes);
  v1::UpdateReport* update = result.mutable_update();
  update->set_points(report.points);
  update->set_points_contradicting(report.contradicting);
  update->set_noise_ratio(report.noise);
  Convert(report.before, update->mutable_points_to_surface_before());
  Convert(report.after, update->mutable_points_to_surface());
  update->set_heights(report.heights);
  update->set_heights_anew(report.heights_anew);
  update->set_heights_filled(report.heights_filled);
  update->set_groups(report.groups);
  update->set_groups_changed(report.groups_changed);
  update->set_update_bytes(report.update_bytes);
  return result;
}

}  // namespace rilievo
