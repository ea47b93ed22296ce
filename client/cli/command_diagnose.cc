#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/scan_diagnosis.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

struct DiagnoseArguments {
  std::string scan;
  ScanArguments reading;
  int threads = 0;
  bool json = false;
};

absl::Status Diagnose(const DiagnoseArguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.inputs = {arguments.scan}, .text = {"-"}}));
  RunContext context;
  context.stop = stop;
  context.threads = arguments.threads;
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadScan(arguments.scan, arguments.reading,
                                                         {.stations = true, .normals = true}));
  const absl::StatusOr<ScanDiagnosis> diagnosis = DiagnoseScan(scan.cloud, scan.place.up, context);
  if (!diagnosis.ok()) return AtPath(arguments.scan, diagnosis.status());
  if (arguments.json) {
    std::cout << DiagnosisJson(*diagnosis, arguments.scan, scan.format);
  } else {
    std::cout << arguments.scan << " (" << scan.format << ")\n" << DiagnosisText(*diagnosis);
  }
  return absl::OkStatus();
}

}  // namespace

Command AddDiagnose(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("diagnose", "Describe a scan and what to expect of its surface");
  const auto arguments = std::make_shared<DiagnoseArguments>();
  app->add_option("SCAN", arguments->scan, "the points; - is standard input")->required();
  AddFormatOption(app, &arguments->reading.format);
  AddScanOptions(app, &arguments->reading);
  AddTrajectoryOption(app, &arguments->reading);
  app->add_option("--threads", arguments->threads, "threads to use; default all")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Diagnose(*arguments, stop); }};
}

}  // namespace rilievo
