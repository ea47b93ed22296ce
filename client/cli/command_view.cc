#include <CLI/CLI.hpp>
#include <cctype>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/text_layout.h"
#include "client/formats/atomic_file.h"
#include "client/picture/render.h"
#include "client/picture/vertex_colors.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

struct ViewArguments {
  std::string input, output, size = "960x720", color = "shade", up = "z";
  std::optional<int> level;
  int views = 1;
  PictureOptions picture;
  bool orthographic = false;
};

// "960" (three quarters as high) or "960x720".
absl::Status ParseSize(const std::string& text, PictureOptions* picture) {
  const size_t cross = text.find('x');
  const bool ok =
      absl::SimpleAtoi(text.substr(0, cross), &picture->width) &&
      (cross == std::string::npos || absl::SimpleAtoi(text.substr(cross + 1), &picture->height));
  if (ok && cross == std::string::npos) picture->height = std::max(16, picture->width * 3 / 4);
  const absl::Status status =
      ok ? picture->Validate()
         : absl::InvalidArgumentError(absl::StrCat("--size ", text, ": write 960 or 960x720"));
  return WithExitCode(status, ExitCode::kUsage);
}

absl::Status Color(const std::string& color, const LoadedShape& shape, Scene* scene) {
  if (color == "shade") return absl::OkStatus();
  const bool by_source = color == "source";
  const size_t known = by_source ? shape.sources.size() : shape.heights.size();
  if (known != static_cast<size_t>(shape.mesh.vertices.cols())) {
    return WithExitCode(
        absl::InvalidArgumentError(absl::StrCat(
            "--color ", color, ": the input does not say it of its vertices; a .dss file does, ",
            by_source ? "and a PLY exported from one" : "up to its finest level")),
        ExitCode::kUsage);
  }
  scene->colors = by_source ? ColorsBySource(shape.sources) : ColorsByValue(shape.heights);
  return absl::OkStatus();
}

absl::Status View(const ViewArguments& arguments, std::stop_token stop) {
  RunContext context;
  context.stop = stop;
  PictureOptions picture = arguments.picture;
  picture.camera.perspective = !arguments.orthographic;
  picture.camera.up = arguments.up == "y" ? UpAxis::kY : UpAxis::kZ;
  RILIEVO_RETURN_IF_ERROR(ParseSize(arguments.size, &picture));
  RILIEVO_ASSIGN_OR_RETURN(LoadedShape shape, LoadShape(arguments.input, arguments.level, context));
  Scene scene;
  RILIEVO_RETURN_IF_ERROR(Color(arguments.color, shape, &scene));
  scene.mesh = std::move(shape.mesh);
  RILIEVO_ASSIGN_OR_RETURN(const Image image,
                           arguments.views == 1
                               ? RenderPicture(scene, picture, context)
                               : RenderSheet(scene, picture, arguments.views, context));
  RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodePng(image));
  const absl::Status written = WriteFileAtomically(arguments.output, [&](std::ostream& out) {
    out << png;
    return absl::OkStatus();
  });
  RILIEVO_RETURN_IF_ERROR(WithExitCode(written, ExitCode::kOutput));
  std::cout << Wrap(absl::StrCat(arguments.output, ": ", image.width, " x ", image.height, ", ",
                                 shape.description),
                    2)
            << '\n';
  return absl::OkStatus();
}

}  // namespace

Command AddView(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "view", "Draw a surface, a mesh or a scan as a PNG, without a display");
  const auto arguments = std::make_shared<ViewArguments>();
  app->add_option("IN", arguments->input, "a surface (.dss), a mesh or a scan")->required();
  app->add_option("-o,--output", arguments->output, "the picture, a PNG")->required();
  app->add_option("--level", arguments->level, "of a surface; default the finest")
      ->check(CLI::Range(0, 10));
  app->add_option("--size", arguments->size, "in pixels: W or WxH")->capture_default_str();
  app->add_option("--turn", arguments->picture.camera.turn_degrees, "around the up axis, degrees")
      ->capture_default_str();
  app->add_option("--elevation", arguments->picture.camera.elevation_degrees,
                  "above the horizon, degrees")
      ->check(CLI::Range(-90.0, 90.0))
      ->capture_default_str();
  app->add_option("--views", arguments->views, "pictures on the sheet")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  app->add_option("--up", arguments->up, "the axis that points up: y or z")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  app->add_option("--color", arguments->color,
                  "shade; height (red above the domain surface, blue below); source (measured "
                  "grey, smoothed blue, filled in orange)")
      ->check(CLI::IsMember({"shade", "height", "source"}))
      ->capture_default_str();
  app->add_flag("--flat", arguments->picture.flat, "show the facets");
  app->add_flag("--orthographic", arguments->orthographic, "without perspective");
  return {app, [arguments](std::stop_token stop) { return View(*arguments, stop); }};
}

}  // namespace rilievo
