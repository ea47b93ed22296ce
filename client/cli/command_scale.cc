#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/measure_words.h"
#include "client/cli/output_target.h"
#include "client/cli/surface_output.h"
#include "client/cli/vector_json.h"
#include "core/base/status_macros.h"
#include "core/codec/container/encode_deformed.h"
#include "core/domain/scale_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct ScaleArguments {
  std::string input, to, keep;  // `keep`: a file; empty: none
  SurfaceOutputArguments output;
  bool json = false;
};

std::optional<Eigen::Vector3d> ReadPlace(const nlohmann::json& value) {
  if (!value.is_array() || value.size() != 3) return std::nullopt;
  Eigen::Vector3d place;
  for (size_t i = 0; i < 3; ++i) {
    if (!value[i].is_number()) return std::nullopt;
    place[static_cast<Eigen::Index>(i)] = value[i].get<double>();
  }
  return place;
}

// Whether the numbers describe a feature ScaleSurface() says.
absl::StatusOr<std::vector<KeptFeature>> ReadFeatures(const std::string& path) {
  std::vector<KeptFeature> features;
  if (path.empty()) return features;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(path));
  const auto list = nlohmann::json::parse(bytes, nullptr, /*allow_exceptions=*/false);
  const auto wrong = [&](const std::string& what) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": ", what,
        R"(; it must be a list such as [{"from": [0, 0, 0], "to": [0, 0, 5], "radius": 2}])"));
  };
  if (!list.is_array()) return wrong("no list in JSON");
  for (const nlohmann::json& entry : list) {
    const std::string name = absl::StrCat("feature ", features.size() + 1);
    if (!entry.is_object()) return wrong(absl::StrCat(name, " is no object"));
    for (const auto& [key, value] : entry.items()) {
      if (key != "from" && key != "to" && key != "radius") {
        return wrong(absl::StrCat(name, " has '", key, "'"));
      }
    }
    const auto from = ReadPlace(entry.value("from", nlohmann::json())),
               to = ReadPlace(entry.value("to", nlohmann::json()));
    const nlohmann::json radius = entry.value("radius", nlohmann::json());
    if (!from || !to || !radius.is_number()) {
      return wrong(absl::StrCat(name, " lacks the three numbers of 'from' or 'to', or 'radius'"));
    }
    features.push_back({*from, *to, radius.get<double>()});
  }
  return features;
}

std::string SizeText(const Eigen::Vector3d& size) {
  return absl::StrCat(size.x(), " x ", size.y(), " x ", size.z());
}

void Print(const ScaleArguments& arguments, const ScaledSurface& scaled, size_t bytes,
           size_t features) {
  if (arguments.json) {
    std::cout << nlohmann::ordered_json({{"output", arguments.output.output},
                                         {"bytes", bytes},
                                         {"size_before", VectorJson(scaled.size_before)},
                                         {"size", VectorJson(scaled.size)},
                                         {"features", features},
                                         {"held_control_points", scaled.held},
                                         {"rounds", scaled.rounds}})
                     .dump(2)
              << '\n';
    return;
  }
  WordsBeside(arguments.output.output)
      << arguments.output.output << '\n'
      << LabelledLine("box", absl::StrCat(SizeText(scaled.size), ", ", SizeText(scaled.size_before),
                                          " before"))
      << LabelledLine(
             "kept",
             absl::StrCat(Counted(static_cast<int64_t>(features), "feature", "features"), " with ",
                          Counted(scaled.held, "control point", "control points")))
      << LabelledLine("size", absl::StrCat(Counted(static_cast<int64_t>(bytes), "byte", "bytes"),
                                           " as a .dss file"));
}

absl::Status Scale(const ScaleArguments& arguments, std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input, arguments.keep}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  const auto size = ReadNumbers(arguments.to, 3);
  if (!size || (size->array() <= 0).any()) {
    return UsageError(
        absl::StrCat("--to ", arguments.to, ": must be X,Y,Z, three lengths above 0"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<KeptFeature> features, ReadFeatures(arguments.keep));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> before, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, before, context));
  const auto scaled = ScaleSurface(own.surface, *size, features, context);
  if (!scaled.ok()) {
    return absl::Status(scaled.status().code(),
                        absl::StrCat(arguments.input, ": ", scaled.status().message()));
  }
  const auto after = ReplaceControlMesh(before, scaled->cage);
  if (!after.ok()) {
    return absl::Status(after.status().code(),
                        absl::StrCat(arguments.input, ": ", after.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, *after, context));
  Print(arguments, *scaled, after->size(), features.size());
  return absl::OkStatus();
}

}  // namespace

Command AddScale(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "scale", "Scale a surface to a box, while some features keep their shape");
  const auto arguments = std::make_shared<ScaleArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option("--to", arguments->to, "the sides of the new box, in the unit of the surface")
      ->type_name("X,Y,Z")
      ->required();
  app->add_option("--keep", arguments->keep,
                  R"(features that keep their shape, as JSON: a list of {"from": [X, Y, Z], "to": )"
                  R"([X, Y, Z], "radius": R}, each what lies within R of the line between two )"
                  "places, such as a bore with its wall")
      ->type_name("FILE");
  AddSurfaceOutput(app, "", &arguments->output)->required();
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Scale(*arguments, stop); }};
}

}  // namespace rilievo
