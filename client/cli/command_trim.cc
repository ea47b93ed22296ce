#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_manifold.h"
#include "client/cli/make_surfaces.h"
#include "client/cli/measure_words.h"
#include "client/cli/output_target.h"
#include "client/formats/mesh_writer.h"
#include "core/base/status_macros.h"
#include "core/booleans/trim_mesh.h"

namespace rilievo {
namespace {

struct TrimArguments {
  MakingArguments making;
  std::string format, keep;
  std::string kept_mesh;  // file for the triangles; empty: none
  std::string plane, box, sphere, polyline, along;
  bool cap = false;

  const std::string& input() const { return making.inputs[0]; }
  KeptSide side() const { return keep == "inside" ? KeptSide::kInside : KeptSide::kOutside; }
  std::string Name() const { return absl::StrCat(input(), ", trimmed"); }
};

absl::Status WrongTrimWord(const std::string& option, const std::string& word,
                           const std::string& right) {
  return UsageError(absl::StrCat(option, " ", word, ": must be ", right));
}

absl::StatusOr<TrimShape> ReadPolyline(const TrimArguments& arguments) {
  const auto along = ReadNumbers(arguments.along, 3);
  if (!along) return WrongTrimWord("--along", arguments.along, "DX,DY,DZ");
  RILIEVO_ASSIGN_OR_RETURN(ScanFile file, LoadScan(arguments.polyline, {}));
  return TrimPrism{std::move(file.cloud.points), *along};
}

// What is wrong with the numbers themselves BoundsOf() says.
absl::StatusOr<TrimShape> ReadTrimShape(const TrimArguments& arguments) {
  if (!arguments.plane.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<Plane> planes, ReadPlaneWords({arguments.plane}));
    return planes[0];
  }
  if (!arguments.box.empty()) {
    const auto numbers = ReadNumbers(arguments.box, 6);
    if (!numbers) return WrongTrimWord("--box", arguments.box, "two corners, X,Y,Z,X,Y,Z");
    const Eigen::Vector3d a = numbers->head<3>(), b = numbers->tail<3>();
    return TrimBox{a.cwiseMin(b), a.cwiseMax(b)};
  }
  if (!arguments.sphere.empty()) {
    const auto numbers = ReadNumbers(arguments.sphere, 4);
    if (!numbers) return WrongTrimWord("--sphere", arguments.sphere, "X,Y,Z,RADIUS");
    return TrimSphere{numbers->head<3>(), (*numbers)[3]};
  }
  if (!arguments.polyline.empty()) return ReadPolyline(arguments);
  return UsageError(
      "the shape is missing; give --plane, --box, --sphere or --polyline with --along");
}

absl::StatusOr<Source> ReadTrimmed(const TrimArguments& arguments, const TrimShape& shape,
                                   const std::stop_token& stop) {
  RunContext context;
  context.stop = stop;
  context.threads = static_cast<int>(arguments.making.options.threads.value_or(0));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoadedShape given,
      LoadManifold(arguments.input(), arguments.format, arguments.making.options.place, context));
  absl::StatusOr<TrimmedMesh> made = arguments.cap
                                         ? TrimSolid(given.mesh, shape, arguments.side(), context)
                                         : TrimMesh(given.mesh, shape, arguments.side(), context);
  if (!made.ok()) return AtPath(arguments.Name(), made.status());
  if (!arguments.kept_mesh.empty()) {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(
        WriteMesh(arguments.kept_mesh, "ply", made->mesh, {}, {}, given.place), ExitCode::kOutput));
  }
  Source source;
  source.scan.cloud.points = std::move(made->mesh.vertices);
  source.scan.cloud.triangles = std::move(made->mesh.triangles);
  source.scan.format = given.description;
  source.scan.place = given.place;
  source.paths = ReportPaths{arguments.Name(), source.scan.format, {}};
  return source;
}

absl::Status Trim(const TrimArguments& arguments, const std::stop_token& stop) {
  if (!arguments.kept_mesh.empty()) {
    RILIEVO_RETURN_IF_ERROR(
        CheckExtension(arguments.kept_mesh, "ply", "the trimmed triangles are a PLY file"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const TrimShape shape, ReadTrimShape(arguments));
  if (const absl::Status bounds = BoundsOf(shape).status(); !bounds.ok()) {
    return WithExitCode(bounds, ExitCode::kUsage);
  }
  const auto read = [&](const std::string&) { return ReadTrimmed(arguments, shape, stop); };
  return MakeSurfaces(arguments.making, {arguments.input()}, read, {arguments.kept_mesh}, stop);
}

}  // namespace

Command AddTrim(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("trim", "Cut a surface along a plane, a box, a sphere or a polyline");
  const auto a = std::make_shared<TrimArguments>();
  app->add_option("IN", a->making.inputs,
                  "a surface (.dss), at its finest level, or a mesh, open or closed: PLY, OBJ, "
                  "STL, GLB; - is standard input")
      ->required()
      ->expected(1);
  CLI::Option* plane =
      app->add_option("--plane", a->plane,
                      "cut by this plane: z=D (or x=D, y=D), or A,B,C,D for the places where "
                      "A x + B y + C z = D; inside is where that is less than D")
          ->type_name("PLANE");
  CLI::Option* box = app->add_option("--box", a->box, "cut by the box between two corners")
                         ->type_name("X,Y,Z,X,Y,Z")
                         ->excludes(plane);
  CLI::Option* sphere = app->add_option("--sphere", a->sphere, "cut by the sphere around X,Y,Z")
                            ->type_name("X,Y,Z,RADIUS")
                            ->excludes(plane)
                            ->excludes(box);
  CLI::Option* along =
      app->add_option("--along", a->along, "the direction of --polyline")->type_name("DX,DY,DZ");
  CLI::Option* polyline =
      app->add_option("--polyline", a->polyline,
                      "cut by a closed polyline, swept along a direction: the points of this file "
                      "(XYZ, PLY, OBJ without faces) in their order, of which the last joins the "
                      "first")
          ->type_name("FILE")
          ->needs(along)
          ->excludes(plane)
          ->excludes(box)
          ->excludes(sphere);
  along->needs(polyline);
  app->add_option("--keep", a->keep, "which side of the shape stays: inside or outside")
      ->required()
      ->check(CLI::IsMember({"inside", "outside"}));
  app->add_flag("--cap", a->cap,
                "close the surface along the shape, as 'rilievo combine' with the shape as a solid "
                "does; the input must be closed");
  AddMakingOptions(app, ShapeInput::kMesh, &a->making);
  for (const char* name : {"--colors", "--boundary"}) app->remove_option(app->get_option(name));
  app->add_option("--keep-mesh", a->kept_mesh,
                  "write the trimmed triangles that the surface is made of to this .ply file; "
                  "those of both sides have the same border, to the last bit");
  AddFormatOption(app, &a->format);
  return {app, [a](const std::stop_token& stop) {
            a->making.further_inputs = {a->polyline};
            if (!a->cap) a->making.options.boundary = "exact";
            return Trim(*a, stop);
          }};
}

}  // namespace rilievo
