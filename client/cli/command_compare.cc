#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/scan_error.h"
#include "core/base/status_macros.h"
#include "core/surface/measure_error.h"
#include "server/command_line/real_range.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

struct CompareArguments {
  std::string a, b;
  MeasureOptions measure;
  std::optional<double> max_rms, max_distance;  // fractions of A's diagonal
  std::string format;
  bool json = false;
};

Json DistanceJson(const DistanceSummary& summary, double diagonal) {
  return {{"rms", summary.rms},
          {"mean", summary.mean},
          {"p95", summary.p95},
          {"max", summary.max},
          {"rms_percent", 100 * summary.rms / diagonal},
          {"max_percent", 100 * summary.max / diagonal},
          {"samples", summary.samples}};
}

// How many heights come from where, of a shape that tells it: measured, smoothed, filled in.
using SourceCounts = std::array<int64_t, 3>;

SourceCounts CountSources(const LoadedShape& shape) {
  SourceCounts counts{};
  for (const uint8_t source : shape.sources) {
    if (source < counts.size()) ++counts[source];
  }
  return counts;
}

bool Known(const SourceCounts& counts) { return counts != SourceCounts{}; }

Json SourcesJson(const SourceCounts& counts) {
  return {{"measured", counts[0]}, {"smoothed", counts[1]}, {"filled", counts[2]}};
}

std::string SourcesLine(const SourceCounts& counts) {
  const double all = static_cast<double>(counts[0] + counts[1] + counts[2]);
  const auto share = [&](int kind) { return Percent(static_cast<double>(counts[kind]) / all); };
  return absl::StrCat(share(0), " measured, ", share(1), " smoothed, ", share(2), " filled in");
}

// Where one of the two is a set of points and the other a surface.
struct ScanAndSurface {
  bool scan_is_a = false;
  double diagonal = 0;  // of the surface, for a .dss that of its frame
  ScanPlace place;

  ScanError ErrorIn(const TwoSidedError& error) const {
    const DistanceSummary& way = scan_is_a ? error.a_to_b : error.b_to_a;
    return {way.rms, way.p95, way.max, diagonal, place};
  }
};

std::optional<ScanAndSurface> AsScanAndSurface(const LoadedShape& a, const LoadedShape& b) {
  const bool scan_is_a = a.mesh.triangles.cols() == 0;
  if (scan_is_a == (b.mesh.triangles.cols() == 0)) return std::nullopt;
  const LoadedShape &scan = scan_is_a ? a : b, &surface = scan_is_a ? b : a;
  return ScanAndSurface{scan_is_a,
                        surface.diagonal > 0 ? surface.diagonal : DiagonalOf(surface.mesh.vertices),
                        surface.place != ScanPlace() ? surface.place : scan.place};
}

Json CompareJson(const CompareArguments& arguments, const TwoSidedError& error, double diagonal,
                 Json scan_error) {
  Json json;
  json["a"] = arguments.a;
  json["b"] = arguments.b;
  json["scan_to_surface"] = std::move(scan_error);
  json["diagonal_a"] = diagonal;
  json["rms"] = error.rms;
  json["mean"] = error.mean;
  json["p95"] = error.p95;
  json["max"] = error.max;
  json["rms_percent"] = 100 * error.rms / diagonal;
  json["mean_percent"] = 100 * error.mean / diagonal;
  json["p95_percent"] = 100 * error.p95 / diagonal;
  json["max_percent"] = 100 * error.max / diagonal;
  json["a_to_b"] = DistanceJson(error.a_to_b, diagonal);
  json["b_to_a"] = DistanceJson(error.b_to_a, diagonal);
  return json;
}

std::string Row(const char* label, double rms, double mean, double p95, double max) {
  return absl::StrFormat("  %-12s %12s %12s %12s %12s\n", label, Short(rms), Short(mean),
                         Short(p95), Short(max));
}

std::string Row(const char* label, const DistanceSummary& s) {
  return Row(label, s.rms, s.mean, s.p95, s.max);
}

// Of both ways together; what exceeds its bound, in words.
absl::Status CheckBounds(const CompareArguments& arguments, const TwoSidedError& error,
                         double diagonal) {
  std::vector<std::string> exceeded;
  const auto check = [&](const char* option, const char* name, std::optional<double> bound,
                         double found) {
    if (!bound || found <= *bound * diagonal) return;
    exceeded.push_back(absl::StrFormat("the %s is %.6g of A's diagonal, above --%s %.6g", name,
                                       found / diagonal, option, *bound));
  };
  check("max-rms", "RMS distance", arguments.max_rms, error.rms);
  check("max-distance", "largest distance", arguments.max_distance, error.max);
  if (exceeded.empty()) return absl::OkStatus();
  return WithExitCode(absl::FailedPreconditionError(absl::StrJoin(exceeded, "; ")),
                      ExitCode::kDiffers);
}

absl::Status Compare(const CompareArguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.inputs = {arguments.a, arguments.b}, .text = {"-"}}));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(LoadedShape a,
                           LoadShape(arguments.a, std::nullopt, context, arguments.format));
  RILIEVO_ASSIGN_OR_RETURN(LoadedShape b,
                           LoadShape(arguments.b, std::nullopt, context, arguments.format));
  const double diagonal = DiagonalOf(a.mesh.vertices);
  if (!(diagonal > 0)) {
    return absl::InvalidArgumentError(
        absl::StrCat(arguments.a, ": all points are the same; there is no scale to compare by"));
  }
  const std::optional<ScanAndSurface> pair = AsScanAndSurface(a, b);
  const std::array<SourceCounts, 2> sources = {CountSources(a), CountSources(b)};
  const Shape shape_a{std::move(a.mesh.vertices), std::move(a.mesh.triangles)};
  const Shape shape_b{std::move(b.mesh.vertices), std::move(b.mesh.triangles)};
  RILIEVO_ASSIGN_OR_RETURN(const TwoSidedError error,
                           MeasureTwoSided(shape_a, shape_b, arguments.measure, context));
  const absl::Status within = CheckBounds(arguments, error, diagonal);
  if (arguments.json) {
    Json json = CompareJson(arguments, error, diagonal,
                            pair ? ScanErrorJson(pair->ErrorIn(error)) : Json());
    if (arguments.max_rms || arguments.max_distance) json["within_bounds"] = within.ok();
    if (Known(sources[0])) json["heights_a"] = SourcesJson(sources[0]);
    if (Known(sources[1])) json["heights_b"] = SourcesJson(sources[1]);
    std::cout << json.dump(2) << '\n';
    return within;
  }
  std::cout << "A " << arguments.a << " (" << a.description << ")\n"
            << "B " << arguments.b << " (" << b.description << ")\n";
  if (pair) {
    std::cout << LabelledLine(
        "error", absl::StrCat("scan to surface: ", ScanErrorText(pair->ErrorIn(error)),
                              "; % of the surface's diagonal; every point of the file counts, also "
                              "those that a reconstruction leaves out"));
  }
  std::cout << absl::StrFormat("  %-12s %12s %12s %12s %12s\n", "distance", "RMS", "mean",
                               "95th perc.", "max")
            << Row("A to B", error.a_to_b) << Row("B to A", error.b_to_a)
            << Row("both", error.rms, error.mean, error.p95, error.max)
            << Row("% of A", 100 * error.rms / diagonal, 100 * error.mean / diagonal,
                   100 * error.p95 / diagonal, 100 * error.max / diagonal)
            << LabelledLine("diagonal", absl::StrCat(Short(diagonal), " (of A's bounding box)"));
  for (const bool first : {true, false}) {
    const SourceCounts& counts = sources[first ? 0 : 1];
    if (!Known(counts)) continue;
    std::cout << LabelledLine(first ? "heights of A" : "heights of B", SourcesLine(counts));
  }
  for (const bool first : {true, false}) {
    if ((first ? shape_a : shape_b).triangles.cols() > 0) continue;
    std::cout << LabelledLine("note", absl::StrCat(first ? "A" : "B",
                                                   " is a set of points: distances to it hold the "
                                                   "gaps between them"));
  }
  return within;
}

}  // namespace

Command AddCompare(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("compare", "Measure the two-sided distance between two shapes");
  const auto arguments = std::make_shared<CompareArguments>();
  app->add_option("A", arguments->a, "a surface (.dss), a mesh or a scan; - is standard input")
      ->required();
  app->add_option("B", arguments->b, "the shape to compare it with")->required();
  AddFormatOption(app, &arguments->format);
  app->add_option("--samples", arguments->measure.samples, "samples per surface")
      ->check(CLI::Range(1000, 10000000))
      ->capture_default_str();
  app->add_option(
         "--max-rms", arguments->max_rms,
         "end with exit code 7 when the RMS distance of both ways is larger, as a fraction "
         "of A's diagonal")
      ->check(RealRange(CLI::Range(0.0, 1.0)));
  app->add_option("--max-distance", arguments->max_distance, "the same of the largest distance")
      ->check(RealRange(CLI::Range(0.0, 1.0)));
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Compare(*arguments, stop); }};
}

}  // namespace rilievo
