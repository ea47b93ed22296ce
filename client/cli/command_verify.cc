#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/paged_scan_source.h"
#include "client/cli/progress_display.h"
#include "client/cli/scan_error.h"
#include "core/base/status_macros.h"
#include "core/codec/container/height_update.h"
#include "core/codec/container/open_dss.h"
#include "core/paging/scratch_file.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/options_text.h"
#include "core/pipeline/verify_pages.h"
#include "server/command_line/text_layout.h"
#include "server/conversion/memory_estimate.h"
#include "server/os/memory_limit.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

struct VerifyArguments {
  std::string input, scan;
  ScanArguments reading;
  bool parts = false;
  std::string scratch;  // folder; empty: where temporary files go
  bool json = false, quiet = false;
};

// A file, and what was found of it.
struct Verified {
  int format_version = 0;
  int64_t layers = 0;
  double diagonal = 0;  // scan unit
  DssMetadata metadata;
  Verification verification;
};

const char* ScanName(StatedScan scan) {
  switch (scan) {
    case StatedScan::kNotGiven:
      return "not-given";
    case StatedScan::kSame:
      return "same";
    case StatedScan::kOther:
      return "other";
    case StatedScan::kUnknown:
      break;
  }
  return "unknown";
}

// What is wrong, in words; empty when all agrees.
std::string Reason(const VerifyArguments& arguments, const Verification& verification) {
  std::vector<std::string> reasons;
  if (verification.scan == StatedScan::kOther) {
    reasons.push_back(absl::StrCat(arguments.scan, " is not what the surface was made from"));
  } else if (verification.scan == StatedScan::kUnknown) {
    reasons.push_back("the file does not say which scan it was made from");
  }
  if (!verification.complete) reasons.push_back("the last layers are missing");
  if (verification.figures.empty()) reasons.push_back("the file states no figures");
  std::vector<std::string> names;
  for (const CertifiedFigure& figure : verification.figures) {
    if (!figure.agrees) names.push_back(figure.name);
  }
  if (!names.empty()) {
    reasons.push_back(absl::StrCat("stated and found differ in ", absl::StrJoin(names, ", ")));
  }
  return absl::StrJoin(reasons, "; ");
}

// As it was measured now; nullopt without a scan, or where the file states nothing to compare with.
std::optional<ScanError> FoundError(const Verified& verified) {
  ScanError error{.diagonal = verified.diagonal, .place = verified.metadata.place};
  bool known = false;
  for (const CertifiedFigure& figure : verified.verification.figures) {
    const double length = figure.found * verified.diagonal;
    if (figure.name == "scan_to_surface_rms") known = true, error.rms = length;
    if (figure.name == "scan_to_surface_p95") error.p95 = length;
    if (figure.name == "scan_to_surface_max") error.max = length;
  }
  return known ? std::optional(error) : std::nullopt;
}

Json VerifyJson(const VerifyArguments& arguments, const Verified& verified) {
  const Verification& verification = verified.verification;
  const DssMetadata& metadata = verified.metadata;
  Json json;
  json["file"] = arguments.input;
  json["format_version"] = verified.format_version;
  json["generator"] = metadata.generator;
  json["options"] = metadata.options;
  json["input_hash"] = absl::BytesToHexString(metadata.input_hash);
  json["layers"] = verified.layers;
  json["complete"] = verification.complete;
  json["scan"] = ScanName(verification.scan);
  const std::optional<ScanError> found = FoundError(verified);
  json["scan_to_surface"] = found ? ScanErrorJson(*found) : Json();
  json["figures"] = Json::object();
  for (const CertifiedFigure& figure : verification.figures) {
    json["figures"][figure.name] = {
        {"stated", figure.stated}, {"found", figure.found}, {"agrees", figure.agrees}};
  }
  json["agrees"] = verification.agrees();
  json["reason"] = Reason(arguments, verification);
  return json;
}

void PrintVerification(const VerifyArguments& arguments, const Verified& verified) {
  const Verification& verification = verified.verification;
  const DssMetadata& metadata = verified.metadata;
  std::cout << arguments.input << '\n'
            << LabelledLine(
                   "file", absl::StrCat("format ", verified.format_version, ", by ",
                                        metadata.generator.empty() ? "?" : metadata.generator, "; ",
                                        Counted(verified.layers, "layer", "layers"),
                                        ", every checksum is right"));
  if (!metadata.options.empty()) std::cout << LabelledLine("options", metadata.options);
  if (verification.scan == StatedScan::kSame) {
    std::cout << LabelledLine(InputName(metadata.topology),
                              absl::StrCat(arguments.scan, " is what the surface was made from"));
  }
  if (const std::optional<ScanError> found = FoundError(verified)) {
    std::cout << LabelledLine("error", absl::StrCat(InputName(metadata.topology), " to surface: ",
                                                    ScanErrorText(*found), "; % of the diagonal"));
  }
  if (!verification.figures.empty()) {
    std::cout << absl::StrFormat("  %-24s %16s %16s\n", "figure", "stated", "found");
  }
  for (const CertifiedFigure& figure : verification.figures) {
    std::cout << absl::StrFormat("  %-24s %16.8g %16.8g%s\n", figure.name, figure.stated,
                                 figure.found, figure.agrees ? "" : "  differs");
  }
  if (verification.scan == StatedScan::kNotGiven) {
    std::cout << LabelledLine("note", "the errors were not looked at; name the scan to check them");
  }
  std::cout << LabelledLine("verdict", verification.agrees() ? "agrees" : "differs");
}

absl::StatusOr<Verified> VerifyInMemory(const VerifyArguments& arguments,
                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenBytes(arguments.input, bytes));
  RILIEVO_ASSIGN_OR_RETURN(const DssMetadata metadata, MetadataWithUpdates(file));
  const absl::StatusOr<StatedOptions> stated = ReadOptionsText(metadata.options);
  if (!arguments.scan.empty() && stated.ok() && stated->parts) {
    return UsageError(absl::StrCat(arguments.input, " was made by parts: add --parts"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                           DecodeBytes(arguments.input, bytes, context));
  std::optional<ScanFile> scan;
  if (!arguments.scan.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(scan, InputName(decoded.metadata.topology) == std::string("mesh")
                                       ? LoadMesh(arguments.scan, arguments.reading.format, false)
                                       : LoadScan(arguments.scan, arguments.reading,
                                                  {.stations = true, .normals = true}));
  }
  RILIEVO_ASSIGN_OR_RETURN(Verification verification,
                           VerifyCertificate(decoded, scan ? &scan->cloud : nullptr, context));
  return Verified{decoded.format_version, static_cast<int64_t>(decoded.chunk_bytes.size()),
                  decoded.surface.frame.diagonal, decoded.metadata, std::move(verification)};
}

// What parts do not take. As of 'rilievo reconstruct --parts'.
absl::Status CheckParts(const VerifyArguments& arguments) {
  const auto refuse = [](const char* option) {
    return UsageError(absl::StrCat("--parts does not go with ", option,
                                   ": it takes the places of the points alone; leave it out"));
  };
  if (!arguments.parts && !arguments.scratch.empty()) {
    return UsageError("--scratch is the folder of --parts: add that");
  }
  if (!arguments.parts) return absl::OkStatus();
  if (arguments.scan.empty()) return UsageError("--parts: name the scan too");
  if (!arguments.reading.trajectory.empty()) return refuse("--trajectory");
  return absl::OkStatus();
}

// A file says how large its parts are, and it may be anybody's.
absl::Status CheckMemory(const PartSizes& sizes, const std::string& path) {
  const int64_t largest =
      std::max({sizes.part_points, sizes.coarse_points / 4, 2 * sizes.block_vertices});
  const int64_t memory = EstimateMemoryOfParts(PartSizes::Of(largest), 0);
  const int64_t there = MemoryForThisProcess();
  if (memory <= there) return absl::OkStatus();
  return WithExitCode(
      absl::ResourceExhaustedError(absl::StrFormat(
          "%s was made by parts of up to %s points, which take about %.1f GB of memory; there are "
          "%.1f GB: verify it where there is more",
          path, Grouped(largest), 1e-9 * static_cast<double>(memory),
          1e-9 * static_cast<double>(there))),
      ExitCode::kInput);
}

absl::StatusOr<Verified> VerifyByParts(const VerifyArguments& arguments,
                                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const OpenedDss file, OpenBytes(arguments.input, bytes));
  RILIEVO_ASSIGN_OR_RETURN(const DssMetadata metadata, MetadataWithUpdates(file));
  RILIEVO_ASSIGN_OR_RETURN(const StatedOptions stated, ReadOptionsText(metadata.options));
  if (!stated.parts && !metadata.input_hash.empty()) {
    return UsageError(absl::StrCat(arguments.input, " was not made by parts: leave --parts out"));
  }
  const PartSizes sizes = stated.parts.value_or(PartSizes{});
  RILIEVO_RETURN_IF_ERROR(sizes.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckMemory(sizes, arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(
      const std::shared_ptr<const PagedScan> scan,
      PageScan(arguments.scan, arguments.reading, arguments.scratch, context.stop));
  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  RunContext shown = context;
  shown.progress = [&display](const Progress& progress) {
    display.Update(static_cast<int>(progress.stage) + 1, kStageCount, StageName(progress.stage),
                   progress.fraction);
  };
  RILIEVO_ASSIGN_OR_RETURN(Verification verification, VerifyPaged(bytes, *scan, shown));
  display.Finish();
  return Verified{file.version, static_cast<int64_t>(file.chunk_bytes.size()),
                  file.header.frame.diagonal, metadata, std::move(verification)};
}

absl::Status Verify(const VerifyArguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckParts(arguments));
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.inputs = {arguments.input, arguments.scan}, .text = {"-"}}));
  RunContext context;
  context.stop = stop;
  const absl::StatusOr<Verified> verified =
      arguments.parts ? VerifyByParts(arguments, context) : VerifyInMemory(arguments, context);
  if (IsOfScratchFolder(verified.status())) {
    return WithExitCode(verified.status(), ExitCode::kOutput);
  }
  RILIEVO_RETURN_IF_ERROR(verified.status());
  const Verification& verification = verified->verification;
  if (arguments.json) {
    std::cout << VerifyJson(arguments, *verified).dump(2) << '\n';
  } else {
    PrintVerification(arguments, *verified);
  }
  if (verification.agrees()) return absl::OkStatus();
  return WithExitCode(absl::FailedPreconditionError(
                          absl::StrCat(arguments.input, ": ", Reason(arguments, verification))),
                      ExitCode::kDiffers);
}

}  // namespace

Command AddVerify(CLI::App& program) {
  CLI::App* app = program.add_subcommand("verify", "Check what a surface file states about itself");
  const auto arguments = std::make_shared<VerifyArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option("SCAN", arguments->scan,
                  "the scan or mesh it was made from: checks the errors too");
  AddFormatOption(app, &arguments->reading.format);
  AddScanOptions(app, &arguments->reading);
  AddTrajectoryOption(app, &arguments->reading);
  app->add_flag("--parts", arguments->parts,
                "for a surface made by parts: the points of the scan go to disk, and are measured "
                "a part at a time");
  app->add_option("--scratch", arguments->scratch,
                  "the folder for parts, with room for 60 bytes a point; nothing stays there "
                  "(default: TMPDIR, or /var/tmp)");
  app->add_flag("--quiet", arguments->quiet, "show no progress");
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Verify(*arguments, stop); }};
}

}  // namespace rilievo
