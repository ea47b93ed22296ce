#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/alignment_words.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/output_folder.h"
#include "client/cli/output_target.h"
#include "client/cli/scan_set.h"
#include "client/formats/scan_writer.h"
#include "core/base/status_macros.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct AlignArguments {
  std::vector<std::string> scans;
  std::string output;
  ScanArguments reading;
  PlaceArguments place;
  int threads = 0;
  bool json = false;
};

// One file of all scans, one for each in a folder, or none.
absl::StatusOr<std::vector<std::string>> OutputsOf(const AlignArguments& arguments) {
  if (arguments.output.empty()) return std::vector<std::string>();
  if (NamesAFolder(arguments.output)) {
    return PathsInFolder(arguments.scans, arguments.output, ".ply");
  }
  RILIEVO_RETURN_IF_ERROR(CheckExtension(arguments.output, "ply", "aligned scans are PLY files"));
  return std::vector<std::string>{arguments.output};
}

absl::Status WriteSet(const std::vector<std::string>& outputs, const AlignArguments& arguments,
                      ScanSet set) {
  if (outputs.empty()) return absl::OkStatus();
  if (!NamesAFolder(arguments.output)) {
    RILIEVO_ASSIGN_OR_RETURN(const ScanFile merged, MergeSet(std::move(set)));
    return WithExitCode(WritePlyScan(outputs[0], merged.cloud, merged.layers), ExitCode::kOutput);
  }
  for (size_t i = 0; i < outputs.size(); ++i) {
    RILIEVO_RETURN_IF_ERROR(
        WithExitCode(WritePlyScan(outputs[i], set.clouds[i], set.layers[i]), ExitCode::kOutput));
  }
  return absl::OkStatus();
}

absl::Status Align(const AlignArguments& arguments, std::stop_token stop) {
  if (arguments.scans.size() < 2) {
    return UsageError(absl::StrCat(arguments.scans[0], ": one scan alone; give at least two"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> outputs, OutputsOf(arguments));
  std::vector<std::string> inputs = arguments.scans;
  inputs.push_back(arguments.reading.trajectory);
  RILIEVO_RETURN_IF_ERROR(CheckFiles({inputs, outputs, {arguments.json ? "-" : ""}}));
  RunContext context;
  context.stop = std::move(stop);
  context.threads = arguments.threads;
  const bool writes = !outputs.empty();
  RILIEVO_ASSIGN_OR_RETURN(
      ScanSet set,
      LoadScans(arguments.scans, arguments.reading, arguments.place,
                {.intensity = writes, .colors = writes, .stations = true, .normals = true}));
  RILIEVO_ASSIGN_OR_RETURN(Alignment alignment, AlignSet(context, &set));
  const AlignmentReport report{arguments.scans, std::move(alignment), set.place};
  if (arguments.json) {
    std::cout << AlignmentJson(report).dump(2) << '\n';
  } else {
    WordsBeside(arguments.output) << AlignmentText(report);
  }
  RILIEVO_RETURN_IF_ERROR(CheckAlignment(report));
  return WriteSet(outputs, arguments, std::move(set));
}

}  // namespace

Command AddAlign(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "align", "Bring overlapping scans together that lie roughly where they belong");
  const auto a = std::make_shared<AlignArguments>();
  app->add_option("SCAN", a->scans,
                  "two scans or more, each off by at most about 5 degrees and 3 % of the diagonal; "
                  "the first stays where it is")
      ->required();
  app->add_option("-o,--output", a->output,
                  "the aligned scans: one .ply file of all, or a folder (DIR/) with a .ply file "
                  "for each; without it they are measured only; - is standard output (.ply)");
  AddFormatOption(app, &a->reading.format);
  AddScanOptions(app, &a->reading);
  AddTrajectoryOption(app, &a->reading);
  AddPlaceOptions(app, &a->place);
  app->add_option("--threads", a->threads, "threads to use; default all")
      ->check(CLI::Range(0, 1024));
  app->add_flag("--json", a->json, "print JSON");
  return {app, [a](std::stop_token stop) { return Align(*a, stop); }};
}

}  // namespace rilievo
