#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_manifold.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/make_surfaces.h"
#include "client/cli/output_target.h"
#include "client/cli/scan_set.h"
#include "client/formats/mesh_writer.h"
#include "core/base/status_macros.h"
#include "core/booleans/combine_solids.h"
#include "core/geometry/disjoint_sets.h"
#include "core/surface/mass_properties.h"

namespace rilievo {
namespace {

struct CombineArguments {
  MakingArguments making;
  std::string format;
  std::string kept_mesh;  // file for the triangles; empty: none
  bool unite = false, intersect = false, subtract = false;

  const std::string& first() const { return making.inputs[0]; }
  const std::string& second() const { return making.inputs[1]; }
  SolidOperation operation() const {
    if (unite) return SolidOperation::kUnion;
    return intersect ? SolidOperation::kIntersection : SolidOperation::kDifference;
  }
  std::string Name() const {
    return absl::StrCat(first(),
                        unite       ? " united with "
                        : intersect ? " within "
                                    : " without ",
                        second());
  }
};

// Of the diagonal. Single floats, in which mesh files hold places, are as far apart.
constexpr double kThinnest = 1e-7;

// Each with vertices of its own.
std::vector<TriangleMesh> ComponentsOf(const TriangleMesh& mesh) {
  DisjointSets sets(static_cast<size_t>(mesh.vertices.cols()));
  for (const auto corners : mesh.triangles.colwise()) {
    for (int k = 1; k < 3; ++k) {
      sets.Unite(static_cast<uint32_t>(corners[0]), static_cast<uint32_t>(corners[k]));
    }
  }
  std::map<uint32_t, std::vector<Eigen::Index>> triangles_of;
  for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
    triangles_of[sets.Find(static_cast<uint32_t>(mesh.triangles(0, t)))].push_back(t);
  }
  std::vector<TriangleMesh> components;
  for (const auto& [root, triangles] : triangles_of) {
    TriangleMesh& component = components.emplace_back();
    component.triangles = mesh.triangles(Eigen::all, triangles);
    std::vector<int> vertices(component.triangles.data(),
                              component.triangles.data() + component.triangles.size());
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    component.vertices = mesh.vertices(Eigen::all, vertices);
    for (int& v : component.triangles.reshaped()) {
      const auto found = std::lower_bound(vertices.begin(), vertices.end(), v);
      v = static_cast<int>(found - vertices.begin());
    }
  }
  return components;
}

// A surface holds no solid that is that thin all over. Cavities have a thickness, too.
absl::Status CheckThickness(const TriangleMesh& mesh, const std::string& of) {
  RILIEVO_ASSIGN_OR_RETURN(const MassProperties mass,
                           MassPropertiesOf(mesh.vertices, mesh.triangles));
  const double thickness = 2 * std::abs(mass.volume) / mass.area;
  const double thinnest = kThinnest * DiagonalOf(mesh.vertices);
  if (thickness >= thinnest) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(of, " is ", thickness, " thick in the mean, less than ", thinnest,
                   ", the least that a surface can hold; move one of the shapes"));
}

// All of it, where a film between a side and a cavity shows, and each component by itself.
absl::Status CheckThicknesses(const TriangleMesh& mesh) {
  RILIEVO_RETURN_IF_ERROR(CheckThickness(mesh, "what is left"));
  for (const TriangleMesh& component : ComponentsOf(mesh)) {
    const Eigen::Vector3d at =
        (component.vertices.rowwise().minCoeff() + component.vertices.rowwise().maxCoeff()) / 2;
    RILIEVO_RETURN_IF_ERROR(
        CheckThickness(component, absl::StrCat("a part of what is left, around (", at.x(), ", ",
                                               at.y(), ", ", at.z(), "),")));
  }
  return absl::OkStatus();
}

absl::StatusOr<Source> ReadCombined(const CombineArguments& arguments,
                                    const std::stop_token& stop) {
  RunContext context;
  context.stop = stop;
  context.threads = static_cast<int>(arguments.making.options.threads.value_or(0));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoadedShape a,
      LoadManifold(arguments.first(), arguments.format, arguments.making.options.place, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const LoadedShape b,
      LoadManifold(arguments.second(), arguments.format, arguments.making.options.place, context));
  RILIEVO_RETURN_IF_ERROR(CheckSamePlace(arguments.first(), a.place, arguments.second(), b.place));
  absl::StatusOr<CombinedSolids> made =
      CombineSolids(a.mesh, b.mesh, arguments.operation(), context);
  if (!made.ok()) return AtPath(arguments.Name(), made.status());
  const absl::Status thick = CheckThicknesses(made->mesh);
  if (!thick.ok()) return AtPath(arguments.Name(), thick);
  if (!arguments.kept_mesh.empty()) {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(
        WriteMesh(arguments.kept_mesh, "ply", made->mesh, {}, {}, a.place), ExitCode::kOutput));
  }
  Source source;
  source.scan.cloud.points = std::move(made->mesh.vertices);
  source.scan.cloud.triangles = std::move(made->mesh.triangles);
  source.scan.format = absl::StrCat(a.description, "; ", b.description);
  source.scan.place = a.place;
  source.paths = ReportPaths{arguments.Name(), source.scan.format, {}};
  return source;
}

absl::Status Combine(const CombineArguments& arguments, const std::stop_token& stop) {
  if (!arguments.unite && !arguments.intersect && !arguments.subtract) {
    return UsageError("what to make is missing; give --union, --intersection or --difference");
  }
  if (!arguments.kept_mesh.empty()) {
    RILIEVO_RETURN_IF_ERROR(
        CheckExtension(arguments.kept_mesh, "ply", "the combined triangles are a PLY file"));
  }
  const auto read = [&](const std::string&) { return ReadCombined(arguments, stop); };
  return MakeSurfaces(arguments.making, {arguments.first()}, read, {arguments.kept_mesh}, stop);
}

}  // namespace

Command AddCombine(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "combine", "Unite two solids, intersect them, or take one from the other");
  const auto a = std::make_shared<CombineArguments>();
  app->add_option(
         "SOLID", a->making.inputs,
         "A and B: two closed surfaces (.dss), at their finest level, or closed meshes: PLY, OBJ, "
         "STL, GLB; - is standard input")
      ->required()
      ->expected(2);
  CLI::Option* unite = app->add_flag("--union", a->unite, "what is inside of A or B");
  CLI::Option* intersect =
      app->add_flag("--intersection", a->intersect, "what is inside of both")->excludes(unite);
  app->add_flag("--difference", a->subtract, "what is inside of A and outside of B")
      ->excludes(unite)
      ->excludes(intersect);
  AddMakingOptions(app, ShapeInput::kMesh, &a->making);
  for (const char* name : {"--colors", "--boundary"}) app->remove_option(app->get_option(name));
  app->add_option("--keep-mesh", a->kept_mesh,
                  "write the combined triangles that the surface is made of to this .ply file, for "
                  "verify and compare");
  AddFormatOption(app, &a->format);
  return {app, [a](const std::stop_token& stop) { return Combine(*a, stop); }};
}

}  // namespace rilievo
