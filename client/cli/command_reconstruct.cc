#include <CLI/CLI.hpp>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/make_surfaces.h"
#include "client/cli/output_target.h"
#include "client/cli/paged_scan_source.h"
#include "client/cli/parts_choice.h"
#include "client/cli/scan_set.h"
#include "client/formats/scan_writer.h"
#include "core/base/status_macros.h"
#include "core/paging/scratch_file.h"
#include "core/pipeline/reconstruct.h"
#include "server/command_line/text_layout.h"
#include "server/conversion/memory_estimate.h"
#include "server/conversion/parts_request.h"

namespace rilievo {
namespace {

struct Arguments {
  MakingArguments making;
  ScanArguments scan;
  std::string kept_scan;  // file for the merged scan; empty: none
  bool merge = false, align = false, parts = false;
  uint64_t memory = 0;  // bytes that may be taken; 0: what there is
  int64_t part_points = PartSizes{}.part_points;
  std::string scratch;  // folder; empty: files without names where temporary files go

  const std::vector<std::string>& scans() const { return making.inputs; }
};

absl::StatusOr<Source> ReadOne(const Arguments& arguments, const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan,
                           LoadScan(path, arguments.scan, LayersFor(arguments.making.options)));
  RILIEVO_RETURN_IF_ERROR(ColorAsAsked(arguments.making.options, path, &scan));
  ReportPaths paths{path, scan.format, {}};
  return Source{std::move(scan), std::move(paths)};
}

absl::StatusOr<Source> ReadPaged(const Arguments& arguments, const std::string& path,
                                 const std::stop_token& stop) {
  absl::StatusOr<PagedFile> paged =
      LoadPaged(path, arguments.scan, arguments.making.options,
                {arguments.scratch, PartSizes::Of(arguments.part_points)}, stop);
  if (IsOfScratchFolder(paged.status())) return WithExitCode(paged.status(), ExitCode::kOutput);
  RILIEVO_RETURN_IF_ERROR(paged.status());
  ReportPaths paths{path, paged->file.format, {}};
  return Source{std::move(paged->file), std::move(paths), std::move(paged->scan),
                PartSizes::Of(arguments.part_points), std::move(paged->kept)};
}

absl::StatusOr<Source> ReadMerged(const Arguments& arguments, const std::stop_token& stop) {
  WantedLayers wanted = LayersFor(arguments.making.options);
  if (!arguments.kept_scan.empty()) {
    wanted.intensity = true;
    wanted.colors |= arguments.making.options.colors == "intensity";
  }
  RILIEVO_ASSIGN_OR_RETURN(ScanSet set, LoadScans(arguments.scans(), arguments.scan,
                                                  arguments.making.options.place, wanted));
  ReportPaths paths{NameOfAll(arguments.scans()), "", {}, arguments.scans()};
  if (arguments.align) {
    RunContext context;
    context.stop = stop;
    context.threads = static_cast<int>(arguments.making.options.threads.value_or(0));
    RILIEVO_ASSIGN_OR_RETURN(Alignment alignment, AlignSet(context, &set));
    paths.alignment = AlignmentReport{arguments.scans(), std::move(alignment), set.place};
    RILIEVO_RETURN_IF_ERROR(CheckAlignment(*paths.alignment));
  }
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, MergeSet(std::move(set)));
  paths.scan_format = scan.format;
  if (!arguments.kept_scan.empty()) {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(WritePlyScan(arguments.kept_scan, scan.cloud, scan.layers),
                                         ExitCode::kOutput));
  }
  RILIEVO_RETURN_IF_ERROR(
      ColorAsAsked(arguments.making.options, NameOfAll(arguments.scans()), &scan));
  return Source{std::move(scan), std::move(paths)};
}

// The scans that get a surface of their own: all, or the first in the name of all.
std::vector<std::string> SurfaceNames(const Arguments& arguments) {
  return arguments.merge ? std::vector<std::string>{arguments.scans()[0]} : arguments.scans();
}

absl::Status CheckMerge(const Arguments& arguments) {
  if (arguments.align && arguments.scans().size() < 2) {
    return UsageError(
        absl::StrCat("--align: ", arguments.scans()[0], " is one scan alone; give at least two"));
  }
  if (arguments.kept_scan.empty()) return absl::OkStatus();
  return CheckExtension(arguments.kept_scan, "ply", "the merged scan is a PLY file");
}

// What the points are asked for one by one is not there when they lie on disk.
absl::Status CheckParts(const Arguments& arguments) {
  const ReconstructArguments& options = arguments.making.options;
  const auto refuse = [](const char* option) {
    return UsageError(absl::StrCat("--parts does not go with ", option,
                                   ": it takes the places of the points alone; leave it out"));
  };
  if (!arguments.making.connection.server.empty()) {
    return UsageError("--parts works in this process; leave --server out");
  }
  if (!arguments.scan.trajectory.empty()) return refuse("--trajectory");
  if (options.colors == "intensity") return refuse("--colors intensity");
  if (options.stations == "use") return refuse("--stations use");
  if (options.normals == "use") return refuse("--normals use");
  return absl::OkStatus();
}

std::string MemoryText(int64_t bytes) {
  constexpr int64_t kGigabyte = 1'000'000'000;
  return bytes < kGigabyte ? absl::StrFormat("%.1f MB", 1e-6 * static_cast<double>(bytes))
                           : absl::StrFormat("%.1f GB", 1e-9 * static_cast<double>(bytes));
}

// Whether the scan is made by parts: it was asked for, or the scan does not fit into memory.
absl::StatusOr<bool> InParts(const Arguments& arguments, const std::string& path,
                             const std::stop_token& stop) {
  if (arguments.parts) return true;
  if (!arguments.making.connection.server.empty() || arguments.merge) return false;
  const absl::Status possible = CheckParts(arguments);
  if (!possible.ok() && arguments.memory == 0) return false;
  RILIEVO_ASSIGN_OR_RETURN(const ScanSize size,
                           SizeOfScan(path, arguments.scan, arguments.making.options,
                                      static_cast<int64_t>(arguments.memory), stop));
  if (size.fits()) return false;
  const std::string too_large = absl::StrCat(
      path, ": ", Grouped(size.points), " points or more take about ", MemoryText(size.memory),
      " in memory, and ", MemoryText(size.limit), " may be taken");
  if (!possible.ok()) {
    return WithMessage(possible, absl::StrCat(too_large, ". ", possible.message()));
  }
  const int64_t of_parts = EstimateMemoryOfParts(PartSizes::Of(arguments.part_points), size.points);
  if (size.limit < of_parts) {
    return WithExitCode(absl::ResourceExhaustedError(absl::StrCat(
                            too_large, "; by parts they take up to ", MemoryText(of_parts),
                            ": allow that, or fewer --part-points")),
                        ExitCode::kInput);
  }
  if (!arguments.making.quiet) std::cerr << Wrap(too_large + ": made by parts", 0) << std::endl;
  return true;
}

absl::Status Run(const Arguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckMerge(arguments));
  if (arguments.parts) RILIEVO_RETURN_IF_ERROR(CheckParts(arguments));
  const auto read = [&](const std::string& path) -> absl::StatusOr<Source> {
    RILIEVO_ASSIGN_OR_RETURN(const bool in_parts, InParts(arguments, path, stop));
    if (in_parts) {
      absl::StatusOr<Source> source = ReadPaged(arguments, path, stop);
      if (source.ok() && !arguments.parts) {
        const WantedLayers wanted = LayersFor(arguments.making.options);
        source->warning = PlacesAloneWarning(wanted.colors, wanted.stations, wanted.normals);
      }
      return source;
    }
    return arguments.merge ? ReadMerged(arguments, stop) : ReadOne(arguments, path);
  };
  MakingArguments making = arguments.making;
  making.further_inputs = {arguments.scan.trajectory};
  return MakeSurfaces(making, SurfaceNames(arguments), read, {arguments.kept_scan}, stop);
}

}  // namespace

Command AddReconstruct(CLI::App& program) {
  CLI::App* app = program.add_subcommand("reconstruct", "Make a surface or a mesh from a scan");
  const auto a = std::make_shared<Arguments>();
  app->add_option(
         "SCAN", a->making.inputs,
         "the points: PLY, PCD, XYZ, PTS, TXT, OBJ, LAS, LAZ, E57, PTX; - is standard input; "
         "several become several surfaces, or one with --merge")
      ->required();
  AddMakingOptions(app, ShapeInput::kScan, &a->making);
  AddFormatOption(app, &a->scan.format);
  AddScanOptions(app, &a->scan);
  AddTrajectoryOption(app, &a->scan);
  CLI::Option* merge = app->add_flag(
      "--merge", a->merge,
      "one surface of all scans, which must share unit, way up and coordinate reference system");
  app->add_flag("--align", a->align,
                "with --merge: bring the scans together first, as 'rilievo align' does")
      ->needs(merge);
  app->add_option("--keep-scan", a->kept_scan,
                  "with --merge: write the merged scan to this .ply file, for verify and compare")
      ->needs(merge);
  app->add_flag(
         "--parts", a->parts,
         "as for a scan larger than memory: the points go to disk, and the surface is made "
         "of them a part at a time; stations, normals and colours of the points are not used")
      ->excludes(merge);
  app->add_option("--memory", a->memory,
                  "how much may be taken, such as 2GB: a scan that takes more is made by parts "
                  "(default: four fifths of what the machine or the container has)")
      ->transform(CLI::AsSizeValue(true));
  app->add_option(
         "--part-points", a->part_points,
         "points of a part: with fewer a scan made by parts takes less memory, 85 MB and "
         "1.3 to 1.9 KB per point, and shows less detail where it has more than four times as "
         "many; the file states them")
      ->check(CLI::Range(int64_t{2048}, int64_t{1} << 28))
      ->capture_default_str();
  app->add_option("--scratch", a->scratch,
                  "the folder for parts, with room for 60 bytes a point; what is finished stays "
                  "there until the surface is written, and the same command goes on from there "
                  "(default: TMPDIR, or /var/tmp, and nothing stays)");
  return {app, [a](std::stop_token stop) { return Run(*a, stop); }};
}

}  // namespace rilievo
