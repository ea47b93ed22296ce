#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/output_folder.h"
#include "client/cli/output_target.h"
#include "client/formats/atomic_file.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_writer.h"
#include "core/base/status_macros.h"
#include "server/command_line/real_range.h"
#include "server/command_line/text_layout.h"
#include "tests/scans/displaced_views.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

// Of --displaced: as far off as 'rilievo align' is sure to bring right.
constexpr double kDisplacedDegrees = 5, kDisplacedShare = 0.03;

struct SimulateArguments {
  std::string shape, output;
  ScannerOptions scanner;
  bool normals = false, displaced = false, json = false;
};

// One file, or in a folder one for each viewpoint: view_1.ply, ...
absl::StatusOr<std::vector<std::string>> OutputsOf(const SimulateArguments& arguments) {
  const std::string& output = arguments.output;
  if (!NamesAFolder(output)) {
    if (arguments.displaced) {
      return UsageError(absl::StrCat("--displaced: ", output,
                                     " is one scan; write each view into a folder, -o ", output,
                                     "/"));
    }
    RILIEVO_RETURN_IF_ERROR(CheckExtension(output, "ply", "the scan is a PLY file"));
    return std::vector<std::string>{output};
  }
  if (arguments.scanner.views == 0 || arguments.normals) {
    return UsageError(
        absl::StrCat("--output ", output, ": a folder takes a file for each view; ",
                     arguments.normals ? "leave --normals out" : "give at least one with --views"));
  }
  std::vector<std::string> names;
  for (int view = 1; view <= arguments.scanner.views; ++view) {
    names.push_back(absl::StrCat("view_", view));
  }
  return PathsInFolder(names, output, ".ply");
}

absl::Status WriteViews(const SimulateArguments& arguments, const std::vector<std::string>& outputs,
                        const SimulatedScan& scan) {
  const Displacement displacement = {.degrees = arguments.displaced ? kDisplacedDegrees : 0,
                                     .share = arguments.displaced ? kDisplacedShare : 0,
                                     .seed = arguments.scanner.seed};
  const std::vector<DisplacedView> views = DisplaceViews(scan, displacement);
  for (size_t i = 0; i < views.size(); ++i) {
    RILIEVO_RETURN_IF_ERROR(WritePlyScan(outputs[i], views[i].cloud, {}));
  }
  return absl::OkStatus();
}

absl::Status WriteScan(const SimulateArguments& arguments, const SimulatedScan& scan) {
  const Eigen::Matrix3Xd none(3, 0);
  return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
    return WritePlyPoints(scan.cloud.points, arguments.normals ? scan.normals : none, out);
  });
}

absl::Status Simulate(const SimulateArguments& arguments) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> outputs, OutputsOf(arguments));
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.outputs = outputs, .text = {arguments.json ? "-" : ""}}));
  RILIEVO_ASSIGN_OR_RETURN(const ShapePtr shape, MakeShape(arguments.shape));
  RILIEVO_ASSIGN_OR_RETURN(const SimulatedScan scan, SimulateScan(*shape, arguments.scanner));
  const absl::Status written = NamesAFolder(arguments.output) ? WriteViews(arguments, outputs, scan)
                                                              : WriteScan(arguments, scan);
  RILIEVO_RETURN_IF_ERROR(WithExitCode(written, ExitCode::kOutput));
  if (arguments.json) {
    std::cout << nlohmann::ordered_json{{"output", arguments.output},
                                        {"points", scan.cloud.points.cols()},
                                        {"shape", shape->name()},
                                        {"closed", shape->closed()},
                                        {"genus", shape->genus()},
                                        {"components", shape->components()},
                                        {"diagonal", shape->diagonal()}}
                     .dump(2)
              << '\n';
    return absl::OkStatus();
  }
  WordsBeside(arguments.output)
      << Wrap(absl::StrCat(
                  arguments.output, ": ", Counted(scan.cloud.points.cols(), "point", "points"),
                  " of ", shape->name(), " (", shape->closed() ? "closed" : "open", ", genus ",
                  shape->genus(), ", ", Counted(shape->components(), "component", "components"),
                  ", diagonal ", Short(shape->diagonal()), ")"),
              2)
      << '\n';
  return absl::OkStatus();
}

}  // namespace

Command AddSimulate(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "simulate", "Scan an ideal shape with a virtual scanner, for trials and tests");
  const auto arguments = std::make_shared<SimulateArguments>();
  ScannerOptions& scanner = arguments->scanner;
  app->add_option("SHAPE", arguments->shape, absl::StrJoin(ShapeNames(), ", "))
      ->required()
      ->check(CLI::IsMember(ShapeNames()));
  app->add_option("-o,--output", arguments->output,
                  "the scan, a binary PLY of doubles; or a folder (DIR/) for one file with the "
                  "station for each view; - is standard output")
      ->required();
  app->add_option("--points", scanner.points, "number of points")
      ->check(CLI::Range(int64_t{1}, int64_t{200000000}))
      ->capture_default_str();
  app->add_option("--noise", scanner.noise, "range error (1 sigma), fraction of the diagonal")
      ->check(RealRange(CLI::Range(0.0, 0.1)))
      ->capture_default_str();
  app->add_option("--views", scanner.views, "viewpoints; 0: even samples, nothing hidden")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  app->add_option("--outliers", scanner.outliers, "share of false points")
      ->check(RealRange(CLI::Range(0.0, 0.9)))
      ->capture_default_str();
  app->add_option("--dropout", scanner.dropout, "share of lost returns")
      ->check(RealRange(CLI::Range(0.0, 0.95)))
      ->capture_default_str();
  app->add_option("--distance", scanner.view_distance,
                  "distance of the viewpoints, in bounding radii")
      ->check(RealRange(CLI::Range(1.2, 100.0)))
      ->capture_default_str();
  app->add_option("--seed", scanner.seed, "seed of all random choices")->capture_default_str();
  app->add_flag("--normals", arguments->normals, "write the true normals as well");
  app->add_flag("--displaced", arguments->displaced,
                "with a folder: turn each view but the first by 5 degrees and move it by 3 % of "
                "the diagonal, for trials of 'rilievo align'");
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token) { return Simulate(*arguments); }};
}

}  // namespace rilievo
