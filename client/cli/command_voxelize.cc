#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/length_words.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/progress_display.h"
#include "client/cli/vector_json.h"
#include "client/formats/file_kind.h"
#include "client/formats/voxel_writer.h"
#include "core/base/status_macros.h"
#include "core/voxels/shell_voxels.h"
#include "core/voxels/solid_voxels.h"
#include "core/voxels/voxel_distances.h"
#include "core/voxels/voxel_grid.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSteps = 3;

struct VoxelizeArguments {
  std::string input, output, kind = "shell", format;
  std::string voxel;  // see length_words.h
  std::optional<int> resolution, level;
  int band = 3;
  PlaceArguments place;
  bool json = false, quiet = false;

  std::string extension() const { return IsStandardOutput(output) ? "nrrd" : Extension(output); }
};

// What is told of the voxels.
struct Voxelized {
  VoxelGrid grid;
  ScanPlace place;
  std::string of;                 // for people
  std::optional<int64_t> filled;  // voxels of a shell or a solid
  std::optional<double> volume;   // of a solid's voxels, or as signed distances tell it
  std::optional<bool> is_signed;  // distances
  double band = 0;                // of distances, scan unit
};

absl::StatusOr<VoxelGrid> GridOf(const LoadedShape& shape, const VoxelizeArguments& arguments,
                                 const ScanPlace& place) {
  VoxelGridOptions options;
  options.resolution = arguments.resolution;
  options.margin = arguments.kind == "distance" ? arguments.band + 1 : 1;
  if (!arguments.voxel.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const Length length, ParseLength(arguments.voxel));
    if (length.of == Length::Of::kDiagonal) {
      options.voxel =
          length.value * (shape.diagonal > 0 ? shape.diagonal : DiagonalOf(shape.mesh.vertices));
    } else {
      RILIEVO_ASSIGN_OR_RETURN(options.voxel,
                               InScanUnits(length, place, "--voxel", arguments.input));
    }
  }
  absl::StatusOr<VoxelGrid> grid = ChooseVoxelGrid(shape.mesh, options);
  if (grid.ok()) return grid;
  const std::string said(grid.status().message());
  if (absl::IsOutOfRange(grid.status())) return UsageError(absl::StrCat("--", said));
  return absl::Status(grid.status().code(), absl::StrCat(arguments.input, ": ", said));
}

absl::Status Write(const VoxelizeArguments& arguments, const VoxelValues& values,
                   const ScanPlace& place, ProgressDisplay* display) {
  const absl::Status written =
      WriteVoxels(arguments.output, arguments.extension(), values, UnitName(place.metres_per_unit),
                  [display](double share) { display->Update(kSteps, kSteps, "write", share); });
  return absl::IsCancelled(written) ? written : WithExitCode(written, ExitCode::kOutput);
}

absl::StatusOr<Voxelized> MakeVoxels(const LoadedShape& shape, const VoxelizeArguments& arguments,
                                     const RunContext& context, ProgressDisplay* display) {
  Voxelized made;
  made.place = PlaceOf(arguments.place, shape.place);
  made.of = shape.description;
  RILIEVO_ASSIGN_OR_RETURN(made.grid, GridOf(shape, arguments, made.place));
  display->Update(2, kSteps, "voxels", 0);
  const std::string content = absl::StrCat(arguments.kind, " of ", made.of);
  if (arguments.kind == "distance") {
    RILIEVO_ASSIGN_OR_RETURN(const VoxelDistances distances,
                             VoxelDistances::Build(shape.mesh, made.grid, arguments.band, context));
    made.is_signed = distances.is_signed();
    made.band = distances.band();
    VoxelValues values = ValuesOf(distances, content, context);
    if (distances.is_signed()) {
      made.volume = 0;
      values.next = [next = std::move(values.next), voxel = made.grid.voxel,
                     volume = &*made.volume]() -> absl::StatusOr<std::string_view> {
        RILIEVO_ASSIGN_OR_RETURN(const std::string_view bytes, next());
        *volume += VolumeInside(
            {reinterpret_cast<const float*>(bytes.data()), bytes.size() / sizeof(float)}, voxel);
        return bytes;
      };
    }
    RILIEVO_RETURN_IF_ERROR(Write(arguments, values, made.place, display));
    return made;
  }
  absl::StatusOr<VoxelBits> bits = arguments.kind == "shell"
                                       ? ShellVoxels(shape.mesh, made.grid, context)
                                       : SolidVoxels(shape.mesh, made.grid, context);
  if (absl::IsFailedPrecondition(bits.status())) {
    return absl::FailedPreconditionError(
        absl::StrCat("--kind solid: ", arguments.input, ": ", bits.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(bits.status());
  made.filled = bits->Count();
  if (arguments.kind == "solid") {
    made.volume = static_cast<double>(*made.filled) * std::pow(made.grid.voxel, 3);
  }
  RILIEVO_RETURN_IF_ERROR(Write(arguments, ValuesOf(*bits, content, context), made.place, display));
  return made;
}

Json VoxelizedJson(const VoxelizeArguments& arguments, const Voxelized& made) {
  const VoxelGrid& grid = made.grid;
  const std::string unit = UnitName(made.place.metres_per_unit);
  Json json = {{"kind", arguments.kind},
               {"size", {grid.size.x(), grid.size.y(), grid.size.z()}},
               {"voxel", grid.voxel},
               {"origin", VectorJson(grid.origin)},
               {"unit", unit.empty() ? Json() : Json(unit)},
               {"type", made.filled ? "uint8" : "float"}};
  if (made.filled) json["filled"] = *made.filled;
  if (made.volume) json["volume"] = *made.volume;
  if (made.is_signed) {
    json["signed"] = *made.is_signed;
    json["band"] = made.band;
  }
  json["output"] = arguments.output;
  return json;
}

void PrintVoxelized(const VoxelizeArguments& arguments, const Voxelized& made, std::ostream& out) {
  const VoxelGrid& grid = made.grid;
  out << Wrap(absl::StrCat(arguments.output, ": ", arguments.kind, " of ", made.of), 2) << '\n'
      << LabelledLine(
             "grid",
             absl::StrCat(grid.size.x(), " x ", grid.size.y(), " x ", grid.size.z(), " voxels of ",
                          LengthText(grid.voxel, made.place), ", from ", grid.origin.x(), " ",
                          grid.origin.y(), " ", grid.origin.z(), ", x fastest"));
  if (made.filled) {
    out << LabelledLine(
        "numbers",
        absl::StrCat("uint8: 1 in ", Counted(*made.filled, "voxel", "voxels"), ", 0 elsewhere"));
  }
  if (made.is_signed) {
    out << LabelledLine("numbers",
                        absl::StrCat("float: distance of the centre, ",
                                     *made.is_signed ? "negative inside"
                                                     : "without a sign because the shape is open",
                                     ", at most ", LengthText(made.band, made.place)));
  }
  if (made.volume) out << LabelledLine("volume", absl::StrFormat("%.9g", *made.volume));
}

absl::Status CheckVoxelize(const VoxelizeArguments& arguments, bool band_given) {
  const std::string extension = arguments.extension();
  if (extension != "nrrd" && extension != "raw" && extension != "vdb") {
    return UsageError(
        absl::StrCat(arguments.output, ": the extension must be .nrrd, .vdb or .raw"));
  }
  if (!arguments.resolution && arguments.voxel.empty()) {
    return UsageError("the size of the voxels is missing; give --resolution or --voxel");
  }
  if (band_given && arguments.kind != "distance") {
    return UsageError("--band is of distances; add --kind distance, or leave it out");
  }
  return CheckFiles({{arguments.input}, {arguments.output}, {arguments.json ? "-" : ""}});
}

absl::Status Voxelize(const VoxelizeArguments& arguments, std::stop_token stop) {
  RunContext context;
  context.stop = stop;
  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  display.Update(1, kSteps, "read", 0);
  RILIEVO_ASSIGN_OR_RETURN(const LoadedShape shape,
                           LoadShape(arguments.input, arguments.level, context, arguments.format));
  RILIEVO_ASSIGN_OR_RETURN(const Voxelized made, MakeVoxels(shape, arguments, context, &display));
  display.Finish();
  if (arguments.json) {
    std::cout << VoxelizedJson(arguments, made).dump(2) << '\n';
  } else {
    PrintVoxelized(arguments, made, WordsBeside(arguments.output));
  }
  return absl::OkStatus();
}

}  // namespace

Command AddVoxelize(CLI::App& program) {
  CLI::App* app = program.add_subcommand("voxelize", "Turn a surface into voxels");
  const auto arguments = std::make_shared<VoxelizeArguments>();
  app->add_option("IN", arguments->input, "a surface (.dss) or a mesh; - is standard input")
      ->required();
  app->add_option("OUT", arguments->output,
                  "the voxels: .nrrd, .vdb (OpenVDB), or .raw for the numbers alone; - is standard "
                  "output, as .nrrd")
      ->required();
  AddFormatOption(app, &arguments->format);
  app->add_option("--kind", arguments->kind,
                  "shell: the voxels that the surface meets; solid: those whose centre is inside "
                  "of a closed surface; distance: how far each centre is from the surface, "
                  "negative inside of a closed one")
      ->check(CLI::IsMember({"shell", "solid", "distance"}))
      ->capture_default_str();
  CLI::Option* resolution =
      app->add_option("--resolution", arguments->resolution,
                      "voxels along the longest side of the surface's bounding box")
          ->check(CLI::Range(1, kMaxVoxelResolution));
  app->add_option("--voxel", arguments->voxel,
                  "edge length of a voxel: 2mm, 0.02u (the scan's own units), 0.1% or 0.001 (of "
                  "the diagonal)")
      ->check(IsLength(1e-9, 1))
      ->excludes(resolution);
  app->add_option("--unit", arguments->place.unit,
                  "what one unit of the coordinates is, where the surface does not say it: km, m, "
                  "dm, cm, mm, um, in, ft or us-ft")
      ->check(CLI::IsMember(UnitNames()));
  app->add_option("--level", arguments->level, "level of detail of a surface; default the finest")
      ->check(CLI::Range(0, 10));
  CLI::Option* band =
      app->add_option("--band", arguments->band,
                      "distances are exact up to so many voxels on both sides, and stay at that "
                      "beyond")
          ->check(CLI::Range(1, VoxelDistances::kMaxBand))
          ->capture_default_str();
  app->add_flag("--json", arguments->json, "print JSON");
  app->add_flag("--quiet", arguments->quiet, "show no progress");
  return {app, [arguments, band](std::stop_token stop) {
            RILIEVO_RETURN_IF_ERROR(CheckVoxelize(*arguments, band->count() > 0));
            return Voxelize(*arguments, stop);
          }};
}

}  // namespace rilievo
