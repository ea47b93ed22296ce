#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/frame_paths.h"
#include "client/cli/length_words.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/web_viewer.h"
#include "client/picture/animation.h"
#include "client/picture/render.h"
#include "client/picture/vertex_colors.h"
#include "core/base/status_macros.h"
#include "core/geometry/vertex_normals.h"
#include "core/surface/error_at_vertices.h"
#include "proto/local_address.h"
#include "server/command_line/real_range.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

constexpr int kFrameMilliseconds = 100;

struct ViewArguments {
  std::string input, output, scan, size = "960x720", colors = "shade", up;
  std::string show = "surface";
  ScanArguments reading;
  std::optional<int> level;
  int views = 1, turntable = 1;
  PictureOptions picture;
  bool orthographic = false, json = false, open = false;
  WebViewerOptions web;
};

// "960" (three quarters as high) or "960x720".
absl::Status ParseSize(const std::string& text, PictureOptions* picture) {
  const size_t cross = text.find('x');
  const bool ok =
      absl::SimpleAtoi(text.substr(0, cross), &picture->width) &&
      (cross == std::string::npos || absl::SimpleAtoi(text.substr(cross + 1), &picture->height));
  if (ok && cross == std::string::npos) picture->height = std::max(16, picture->width * 3 / 4);
  if (!ok) return UsageError(absl::StrCat("--size ", text, ": write 960 or 960x720"));
  return WithExitCode(picture->Validate(), ExitCode::kUsage);
}

// Colours of the vertices, and what they mean in words.
struct Coloring {
  Eigen::Matrix3Xf colors;
  std::string legend;
};

absl::Status Unknown(const std::string& colors) {
  return UsageError(absl::StrCat("--colors ", colors,
                                 ": the input does not say it of its vertices; a .dss file does",
                                 colors == "flags" ? ", and a PLY exported from one" : ""));
}

absl::StatusOr<Coloring> ColorByDisplacement(const LoadedShape& shape) {
  if (shape.heights.size() != static_cast<size_t>(shape.mesh.vertices.cols())) {
    return Unknown("displacement");
  }
  return Coloring{ColorsByValue(shape.heights),
                  absl::StrCat("red above the smooth surface, blue below, full colour at ",
                               Percent(FullColorValue(shape.heights)), " of the diagonal")};
}

absl::StatusOr<Coloring> ColorByChange(const LoadedShape& shape, const std::string& input) {
  if (shape.changes.empty()) {
    return UsageError(
        absl::StrCat("--colors change: ", input, " has no updates, or none at this level"));
  }
  return Coloring{
      ColorsByValue(shape.changes),
      absl::StrCat("red where the last update raised the surface, blue where it lowered "
                   "it, full colour at ",
                   Percent(FullColorValue(shape.changes)), " of the diagonal")};
}

absl::StatusOr<Coloring> ColorByError(const LoadedShape& shape, const ViewArguments& arguments,
                                      const RunContext& context) {
  if (arguments.scan.empty()) {
    return UsageError("--colors error: name the scan that the error is to: --scan SCAN");
  }
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadScan(arguments.scan, arguments.reading));
  RILIEVO_ASSIGN_OR_RETURN(const VertexErrors errors,
                           ErrorAtVertices(shape.mesh, scan.cloud.points, context));
  return Coloring{ColorsByValue(errors.at_vertex),
                  absl::StrCat("scan to surface: RMS ", LengthText(errors.rms, shape.place),
                               ", at each vertex from white, 0, to full red, ",
                               LengthText(FullColorValue(errors.at_vertex), shape.place),
                               "; grey where there are no points")};
}

absl::StatusOr<Coloring> ColoringOf(const LoadedShape& shape, const ViewArguments& arguments,
                                    const RunContext& context) {
  if (arguments.colors == "own") {
    if (shape.colors.size() != static_cast<size_t>(shape.mesh.vertices.cols())) {
      return UsageError(
          absl::StrCat("--colors own: ", arguments.input, " has no colours; leave --colors out"));
    }
    return Coloring{ColorsAsGiven(shape.colors), "those of the input"};
  }
  if (arguments.colors == "displacement") return ColorByDisplacement(shape);
  if (arguments.colors == "change") return ColorByChange(shape, arguments.input);
  if (arguments.colors == "error") return ColorByError(shape, arguments, context);
  if (arguments.colors == "flags") {
    if (shape.sources.size() != static_cast<size_t>(shape.mesh.vertices.cols())) {
      return Unknown("flags");
    }
    return Coloring{ColorsBySource(shape.sources),
                    "heights measured stone, smoothed blue, filled in orange"};
  }
  if (arguments.colors == "normals") {
    const TriangleMesh& mesh = shape.mesh;
    if (mesh.triangles.cols() == 0 && mesh.normals.cols() == 0) return Unknown("normals");
    return Coloring{ColorsByNormal(mesh.normals.cols() == mesh.vertices.cols()
                                       ? mesh.normals
                                       : VertexNormals(mesh.vertices, mesh.triangles)),
                    "x, y and z of the normals as red, green and blue"};
  }
  return Coloring{};
}

absl::StatusOr<std::vector<Image>> Render(const Scene& scene, PictureOptions picture,
                                          const ViewArguments& arguments,
                                          const RunContext& context) {
  std::vector<Image> images;
  picture.steady = arguments.turntable > 1;
  const double start = picture.camera.turn_degrees;
  for (int i = 0; i < arguments.turntable; ++i) {
    picture.camera.turn_degrees = start + 360.0 * i / arguments.turntable;
    RILIEVO_ASSIGN_OR_RETURN(
        Image image, arguments.views == 1 ? RenderPicture(scene, picture, context)
                                          : RenderSheet(scene, picture, arguments.views, context));
    images.push_back(std::move(image));
  }
  return images;
}

// Numbered files, or one: a picture or an animation.
absl::Status Write(const std::vector<Image>& images, const std::vector<std::string>& paths) {
  if (paths.size() == 1 && images.size() > 1) {
    RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodeAnimation(images, kFrameMilliseconds));
    return WriteText(paths[0], png);
  }
  for (size_t i = 0; i < images.size(); ++i) {
    RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodePng(images[i]));
    RILIEVO_RETURN_IF_ERROR(WriteText(paths[i], png));
  }
  return absl::OkStatus();
}

void SayDrawn(const ViewArguments& arguments, const std::vector<std::string>& paths,
              const PictureOptions& picture, const std::string& shape, const std::string& legend) {
  if (arguments.json) {
    nlohmann::ordered_json json = {{"input", arguments.input},      {"outputs", paths},
                                   {"width", picture.width},        {"height", picture.height},
                                   {"frames", arguments.turntable}, {"shape", shape},
                                   {"colors", arguments.colors},    {"legend", legend}};
    std::cout << json.dump(2) << '\n';
    return;
  }
  std::ostream& out = WordsBeside(arguments.output);
  out << Wrap(absl::StrCat(
                  paths.size() == 1 ? paths[0] : absl::StrCat(paths.front(), " to ", paths.back()),
                  ": ", picture.width, " x ", picture.height,
                  arguments.turntable > 1 ? absl::StrCat(", ", arguments.turntable, " frames") : "",
                  ", ", shape),
              2)
      << '\n';
  if (!legend.empty()) out << LabelledLine("colours", legend);
}

// The server behind the page asks nobody who they are, and has no limits.
absl::Status CheckListen(const std::string& listen) {
  if (IsLocalAddress(listen)) return absl::OkStatus();
  return UsageError(absl::StrCat(
      "--listen ", listen,
      ": others could read IN there and fill this machine; listen on 127.0.0.1:PORT and reach that "
      "with ssh -L PORT:127.0.0.1:PORT, or serve others with a rilievod that has TLS and tokens, "
      "behind the gateway (docs/viewer.md)"));
}

absl::Status OpenWebViewer(const ViewArguments& arguments, std::stop_token stop) {
  if (!arguments.output.empty()) return UsageError("--open shows a page, -o a picture: give one");
  WebViewerOptions web = arguments.web;
  RILIEVO_RETURN_IF_ERROR(CheckListen(web.listen));
  web.file = arguments.input;
  if (web.file == "-") return UsageError("--open: the page reads a file, not the standard input");
  if (!web.file.empty()) {
    if (!std::ifstream(web.file)) {
      return absl::NotFoundError(absl::StrCat(web.file, ": no such file, or it cannot be read"));
    }
  }
  const auto opened = [&](const std::string& url) {
    if (arguments.json) {
      std::cout << nlohmann::ordered_json{{"input", arguments.input}, {"url", url}} << std::endl;
      return;
    }
    std::cout << url << std::endl;
    std::cerr << (OpenInBrowser(url) ? "The page is being opened in the browser. "
                                     : "Open this address in a browser. ")
              << "Ctrl-C ends it.\n";
  };
  return ServeWebViewer(web, opened, std::move(stop));
}

absl::Status View(const ViewArguments& arguments, std::stop_token stop) {
  if (arguments.open) return OpenWebViewer(arguments, std::move(stop));
  if (arguments.input.empty()) return UsageError("IN is missing: what to draw");
  if (arguments.output.empty()) {
    return UsageError("-o is missing: the picture, a PNG; or --open, for the viewer in a browser");
  }
  RILIEVO_RETURN_IF_ERROR(CheckExtension(arguments.output, "png", "the picture is a PNG"));
  RunContext context;
  context.stop = std::move(stop);
  PictureOptions picture = arguments.picture;
  picture.camera.perspective = !arguments.orthographic;
  RILIEVO_RETURN_IF_ERROR(ParseSize(arguments.size, &picture));
  std::vector<std::string> frame_paths;
  if (arguments.turntable > 1) {
    RILIEVO_ASSIGN_OR_RETURN(frame_paths, FramePaths(arguments.output, arguments.turntable));
  }
  const std::vector<std::string> paths =
      frame_paths.empty() ? std::vector{arguments.output} : frame_paths;
  RILIEVO_RETURN_IF_ERROR(
      CheckFiles({{arguments.input, arguments.scan}, paths, {arguments.json ? "-" : ""}}));
  const ShownPart part = arguments.show == "surface"  ? ShownPart::kSurface
                         : arguments.show == "domain" ? ShownPart::kDomain
                                                      : ShownPart::kControlMesh;
  RILIEVO_ASSIGN_OR_RETURN(LoadedShape shape, LoadShape(arguments.input, arguments.level, context,
                                                        arguments.reading.format, part));
  const bool y_up = arguments.up.empty() ? shape.place.up == UpDirection::kY : arguments.up == "y";
  picture.camera.up = y_up ? UpAxis::kY : UpAxis::kZ;
  RILIEVO_ASSIGN_OR_RETURN(Coloring coloring, ColoringOf(shape, arguments, context));
  const Scene scene{std::move(shape.mesh), std::move(coloring.colors)};
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Image> images,
                           Render(scene, picture, arguments, context));
  RILIEVO_RETURN_IF_ERROR(Write(images, paths));
  picture.width = images[0].width;
  picture.height = images[0].height;
  SayDrawn(arguments, paths, picture, shape.description, coloring.legend);
  return absl::OkStatus();
}

void AddWebViewer(CLI::App* app, ViewArguments* arguments) {
  CLI::Option* open = app->add_flag("--open", arguments->open,
                                    "instead of a picture: serve the viewer, with IN in it, print "
                                    "its address and show it in a browser; a scan becomes a "
                                    "surface there. Until Ctrl-C");
  app->add_option("--listen", arguments->web.listen,
                  "HOST:PORT of the page, on this machine; 0: any free port")
      ->needs(open)
      ->capture_default_str();
  app->add_option("--store", arguments->web.store,
                  "folder where the page's jobs are kept; default: nowhere, they end with it")
      ->needs(open);
}

void AddCamera(CLI::App* app, ViewArguments* arguments) {
  app->add_option("--turn", arguments->picture.camera.turn_degrees, "around the up axis, degrees")
      ->capture_default_str();
  app->add_option("--elevation", arguments->picture.camera.elevation_degrees,
                  "above the horizon, degrees")
      ->check(RealRange(CLI::Range(-90.0, 90.0)))
      ->capture_default_str();
  app->add_option("--up", arguments->up,
                  "the axis that points up: y or z; default what a surface says, else z")
      ->check(CLI::IsMember({"y", "z"}));
  app->add_flag("--orthographic", arguments->orthographic, "without perspective");
  CLI::Option* views = app->add_option("--views", arguments->views, "pictures on the sheet")
                           ->check(CLI::Range(1, 4))
                           ->capture_default_str();
  app->add_option("--turntable", arguments->turntable,
                  "so many pictures around: one animated PNG, or numbered files when the output is "
                  "DIR/ or turn-%03d.png")
      ->check(CLI::Range(2, 720))
      ->excludes(views);
}

}  // namespace

Command AddView(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "view", "Draw a surface, a mesh or a scan as a PNG, or show it in a browser");
  const auto arguments = std::make_shared<ViewArguments>();
  app->add_option("IN", arguments->input,
                  "a surface (.dss), a mesh or a scan; - is standard input");
  app->add_option("-o,--output", arguments->output, "the picture, a PNG; - is standard output");
  AddFormatOption(app, &arguments->reading.format);
  app->add_option("--level", arguments->level, "level of detail of a surface; default the finest")
      ->check(CLI::Range(0, 10));
  app->add_option("--show", arguments->show,
                  "of a .dss: the surface, the domain (the smooth surface without heights), or the "
                  "control-mesh")
      ->check(CLI::IsMember({"surface", "domain", "control-mesh"}))
      ->capture_default_str();
  app->add_option(
         "--colors", arguments->colors,
         "shade; own (the colours that IN has); displacement (red above the smooth "
         "surface, blue below); change (by the last update: red up, blue down); error (distance "
         "of the scan's points, white to red); flags (measured stone, smoothed blue, "
         "filled in orange); normals")
      ->check(
          CLI::IsMember({"shade", "own", "displacement", "change", "error", "flags", "normals"}))
      ->capture_default_str();
  app->add_option("--scan", arguments->scan, "the scan of --colors error");
  AddScanOptions(app, &arguments->reading);
  app->add_option("--size", arguments->size, "width, or width x height, in pixels: 960 or 960x720")
      ->capture_default_str();
  AddCamera(app, arguments.get());
  AddWebViewer(app, arguments.get());
  app->add_flag("--flat", arguments->picture.flat, "show the facets");
  app->add_flag("--edges", arguments->picture.edges, "draw the edges");
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return View(*arguments, stop); }};
}

}  // namespace rilievo
