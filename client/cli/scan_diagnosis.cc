#include "client/cli/scan_diagnosis.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/base/status_macros.h"
#include "core/control/build_control_mesh.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/fit_domain.h"
#include "core/scan/scan_surface.h"
#include "server/command_line/text_layout.h"
#include "server/conversion/memory_estimate.h"

namespace rilievo {
namespace {

constexpr double kShares[] = {0.05, 0.25, 0.5, 0.75, 0.95};
// Seconds of fit, heights, measure and coding by those of the stages before, on clean scans and on
// noisy ones, where heights are local fits: 0.7 to 0.8 and 1.2 to 1.5 over the benchmark's clouds.
constexpr double kLaterCleanRatio = 0.75, kLaterNoisyRatio = 1.3;
// Bytes of a .dss a point, beside a head of 1000 at most: 0.03 to 0.2 on noisy clouds, where few
// heights are kept however many control faces there are, 0.04 (smooth shapes without noise) to 0.7
// on the benchmark's clean ones.
constexpr double kNoisyBytesOfPoint[] = {0.01, 0.3}, kCleanBytesOfPoint[] = {0.03, 0.8};
constexpr int kHeadBytes = 1000;
constexpr double kNoisySpacings = 0.1;  // noise from which on heights are smoothed

Quantiles QuantilesOf(const std::vector<float>& values, double factor) {
  std::vector<float> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  Quantiles quantiles{};
  if (sorted.empty()) return quantiles;
  for (size_t i = 0; i < quantiles.size(); ++i) {
    const double at = kShares[i] * static_cast<double>(sorted.size() - 1);
    quantiles[i] = factor * sorted[static_cast<size_t>(std::lround(at))];
  }
  return quantiles;
}

// Each point stands for pi/4 of its spacing squared (see OrientedCloud); dense where spacing is
// low.
Quantiles DensityFrom(const Quantiles& spacing) {
  Quantiles density{};
  for (size_t i = 0; i < density.size(); ++i) {
    const double of_point = std::numbers::pi / 4 * spacing[4 - i] * spacing[4 - i];
    density[i] = of_point > 0 ? 1 / of_point : 0;
  }
  return density;
}

absl::StatusOr<std::vector<double>> LoopLengths(const ControlMesh& mesh, double diagonal) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  std::vector<double> lengths;
  for (const std::vector<int>& loop : BoundaryLoops(topology)) {
    double length = 0;
    for (size_t i = 0; i < loop.size(); ++i) {
      length +=
          (mesh.vertices.col(loop[i]) - mesh.vertices.col(loop[(i + 1) % loop.size()])).norm();
    }
    lengths.push_back(length * diagonal);
  }
  std::sort(lengths.begin(), lengths.end(), std::greater<>());
  return lengths;
}

double Share(int64_t part, int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

std::vector<std::string> AdviceFor(const ScanDiagnosis& d) {
  std::vector<std::string> advice;
  const auto dropped = [&](int64_t count, const char* what, const char* remedy) {
    if (Share(count, d.points_in) <= 0.01) return;
    advice.emplace_back(
        absl::StrCat(Percent(Share(count, d.points_in)), " of the points ", what, remedy));
  };
  dropped(d.non_finite, "are NaN or infinite",
          " and are left out; export the scan without invalid returns to make it smaller.");
  dropped(d.duplicates, "lie exactly on others",
          " and are left out; remove overlaps when registering, or leave them.");
  dropped(d.outliers, "belong to no surface",
          " and are left out; look at the scan for ghosts, or keep them by --outliers keep.");
  dropped(d.island_points, "lie on small islands",
          " and are left out; scan them more densely to keep them.");
  dropped(d.foliage_points, "fill volumes, as leaves do,",
          " and are left out; no surface explains them. --outliers keep keeps them.");
  if (d.noise[2] > d.spacing[2]) {
    advice.emplace_back(
        "The noise exceeds the spacing of the points: detail below the noise will be smoothed "
        "away. "
        "Average several scans, or expect a file of few bytes.");
  } else if (d.noise[2] > kNoisySpacings * d.spacing[2]) {
    advice.emplace_back(
        "The scan is noisy: heights will be local fits (smoothed) rather than measured.");
  }
  if (d.spacing[4] > 5 * d.spacing[0]) {
    advice.emplace_back(
        "The spacing varies much: the surface will be as fine as the typical spacing. Scan the "
        "sparse parts from nearer, or set --max-level.");
  }
  if (d.stations > 0 && !d.stations_used) {
    advice.emplace_back(
        "The stations of the scan contradict its points, and the surface will not face them. "
        "Correct them, or give --stations use if they are right.");
  }
  if (d.normal_disagreement > 0.05) {
    advice.emplace_back(
        "Neighbouring normals disagree in many places: sheets may touch, the surface may be "
        "one-sided, or walls are as thin as the points are apart. Scan thin walls more densely, or "
        "give --control-mesh.");
  }
  if (!d.loop_lengths.empty()) {
    advice.emplace_back(
        "The surface will be open where the scan is. --boundary close closes it, "
        "--close-holes-below LENGTH the shorter loops alone; points from more sides make it "
        "whole.");
  }
  if (d.road == std::string("arbitrary") && d.components > 1) {
    advice.push_back(absl::StrCat("There are ", d.components,
                                  " separate parts; reconstruct them one by one if they should not "
                                  "share one file."));
  }
  if (advice.empty()) advice.emplace_back("No problems found.");
  return advice;
}

void Expect(double seconds_so_far, ScanDiagnosis* d) {
  const bool noisy = d->noise[2] > kNoisySpacings * d->spacing[2];
  d->expected_seconds = seconds_so_far * (1 + (noisy ? kLaterNoisyRatio : kLaterCleanRatio));
  const double* bytes = noisy ? kNoisyBytesOfPoint : kCleanBytesOfPoint;
  const auto points = static_cast<double>(d->points_used);
  d->expected_bytes_low = std::llround(bytes[0] * points);
  d->expected_bytes_high = std::llround(bytes[1] * points) + kHeadBytes;
  JobRequest job;
  job.size.points = d->points_in;
  d->expected_memory = EstimateMemory(job);
}

std::string Spread(const Quantiles& q) {
  return absl::StrCat("median ", Short(q[2]), " (5 to 95 %: ", Short(q[0]), " to ", Short(q[4]),
                      ")");
}

const char* SeenFrom(ScanSetting setting) {
  switch (setting) {
    case ScanSetting::kAbove:
      return "from above, by ";
    case ScanSetting::kGround:
      return "from the ground, under the open sky, by ";
    case ScanSetting::kIndoors:
      return "indoors or underground, by ";
    case ScanSetting::kUnknown:
      break;
  }
  return "by ";
}

std::string BytesText(int64_t bytes) {
  if (bytes < 10'000) return absl::StrCat(Grouped(bytes), " bytes");
  if (bytes < 10'000'000) return absl::StrCat(Grouped(bytes / 1000), " KB");
  return absl::StrCat(Grouped(bytes / 1'000'000), " MB");
}

}  // namespace

absl::StatusOr<ScanDiagnosis> DiagnoseScan(const PointCloud& scan, UpDirection up,
                                           const RunContext& context) {
  const auto start = std::chrono::steady_clock::now();
  RILIEVO_ASSIGN_OR_RETURN(CheckedScan checked, CheckScan(scan, {}, context));
  ScanDiagnosis d;
  d.points_in = scan.points.cols();
  d.non_finite = checked.non_finite;
  d.duplicates = checked.duplicates;
  d.strays = checked.strays;
  d.stations = scan.sights.stations.cols();
  d.setting = SettingOf(scan, up);
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface surface, AnalyzeScan(std::move(checked), {}, context));
  RILIEVO_ASSIGN_OR_RETURN(ControlMeshResult control,
                           BuildControlMesh(std::move(surface.cloud), std::move(surface.graph),
                                            surface.index, surface.frame, {}, context));
  surface.cloud = std::move(control.cloud);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;

  d.outliers = surface.figures.outliers;
  d.island_points = surface.figures.island_points;
  d.foliage_points = surface.figures.foliage_points;
  const OrientedCloud& cloud = surface.cloud;
  d.points_used = cloud.points.cols();
  d.diagonal = surface.frame.diagonal;
  const Eigen::Vector3d size =
      (cloud.points.rowwise().maxCoeff() - cloud.points.rowwise().minCoeff()) * d.diagonal;
  d.size = {size.x(), size.y(), size.z()};
  d.spacing = QuantilesOf(cloud.spacing, d.diagonal);
  d.noise = QuantilesOf(cloud.noise, d.diagonal);
  d.density = DensityFrom(d.spacing);
  d.stations_used = surface.figures.orientation.stations.used;
  d.normal_disagreement = surface.figures.orientation.disagreement;
  d.contested = Share(std::count(cloud.ambiguous.begin(), cloud.ambiguous.end(), 1), d.points_used);
  d.point_components = surface.figures.orientation.components;
  d.road = TopologyName(control.topology);
  d.road_reason = control.reason;
  d.components = control.components;
  d.genus = control.genus;
  RILIEVO_ASSIGN_OR_RETURN(d.loop_lengths, LoopLengths(control.mesh, d.diagonal));
  // How many faces stay under the noise shows in the fit alone.
  RILIEVO_ASSIGN_OR_RETURN(const Domain domain, FitFewFaces(surface, surface.cloud.median_spacing,
                                                            {}, control.mesh, {}, {context}));
  d.control_faces = static_cast<int>(domain.fit.control_mesh.faces.cols());
  Expect(elapsed.count(), &d);
  d.advice = AdviceFor(d);
  return d;
}

std::string DiagnosisText(const ScanDiagnosis& d) {
  std::string text;
  const auto add = [&](const char* label, const std::string& line) {
    text += LabelledLine(label, line);
  };
  add("points", absl::StrCat(Grouped(d.points_used), " of ", Grouped(d.points_in), " usable; ",
                             Grouped(d.non_finite), " non-finite, ", Grouped(d.duplicates),
                             " duplicate, ", Grouped(d.strays), " stray, ", Grouped(d.outliers),
                             " outlying, ", Grouped(d.island_points), " on islands, ",
                             Grouped(d.foliage_points), " in foliage"));
  add("size", absl::StrCat(Short(d.size[0]), " x ", Short(d.size[1]), " x ", Short(d.size[2]),
                           ", diagonal ", Short(d.diagonal)));
  add("spacing", Spread(d.spacing));
  add("density", absl::StrCat(Spread(d.density), " points per square unit"));
  add("noise",
      absl::StrCat(Spread(d.noise), "; ", Percent(d.noise[2] / d.diagonal), " of the diagonal, ",
                   absl::StrFormat("%.2f", d.spacing[2] > 0 ? d.noise[2] / d.spacing[2] : 0),
                   " spacings"));
  if (d.stations > 0) {
    add("seen", absl::StrCat(SeenFrom(d.setting), Counted(d.stations, "station", "stations"),
                             d.stations_used ? "" : ", not believed"));
  }
  add("normals",
      absl::StrCat(Percent(d.normal_disagreement), " of neighbours disagree, ",
                   Percent(d.contested), " of the points are in doubt about their side"));
  add("parts", absl::StrCat(Counted(d.point_components, "group", "groups"), " of points; ",
                            Counted(d.components, "component", "components"), " of genus ", d.genus,
                            " together"));
  if (d.loop_lengths.empty()) {
    add("holes", "none: the surface will be closed");
  } else {
    std::string lengths;
    for (size_t i = 0; i < std::min<size_t>(5, d.loop_lengths.size()); ++i) {
      absl::StrAppend(&lengths, i == 0 ? "" : ", ", Short(d.loop_lengths[i]));
    }
    add("holes", absl::StrCat("open: ",
                              Counted(static_cast<int64_t>(d.loop_lengths.size()), "boundary loop",
                                      "boundary loops"),
                              ", length ", lengths, d.loop_lengths.size() > 5 ? ", ..." : ""));
  }
  add("topology", absl::StrCat(d.road, ": ", d.road_reason));
  add("expect",
      absl::StrCat("about ", absl::StrFormat("%.1f s", d.expected_seconds), " and ",
                   BytesText(d.expected_memory), " of memory here; a file of ",
                   BytesText(d.expected_bytes_low), " to ", BytesText(d.expected_bytes_high),
                   " over ", Counted(d.control_faces, "control face", "control faces")));
  for (const std::string& sentence : d.advice) add("advice", sentence);
  return text;
}

}  // namespace rilievo
