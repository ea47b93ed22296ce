#include "core/schemes/subdivide_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/loop/crease_topology.h"
#include "core/loop/refinement.h"
#include "core/schemes/scheme_steps.h"

namespace rilievo {
namespace {

struct NamedScheme {
  absl::string_view name;
  SubdivisionScheme scheme;
  bool triangles;
  double growth;  // of the corners of all faces, per step
};

constexpr std::array kSchemes = {
    NamedScheme{"loop", SubdivisionScheme::kLoop, true, 4},
    NamedScheme{"catmull-clark", SubdivisionScheme::kCatmullClark, false, 4},
    NamedScheme{"doo-sabin", SubdivisionScheme::kDooSabin, false, 4},
    NamedScheme{"butterfly", SubdivisionScheme::kButterfly, true, 4},
    NamedScheme{"sqrt3", SubdivisionScheme::kSqrt3, true, 3}};

const NamedScheme& InfoOf(SubdivisionScheme scheme) {
  return *std::find_if(kSchemes.begin(), kSchemes.end(),
                       [&](const NamedScheme& named) { return named.scheme == scheme; });
}

absl::Status CheckSubdivision(const PolygonMesh& mesh, const NamedScheme& scheme, int levels,
                              const SubdivisionTags& tags) {
  if (levels < 0 || levels > kMostSubdivisionLevels) {
    return absl::InvalidArgumentError(
        absl::StrCat("levels = ", levels, ": must be in [0, ", kMostSubdivisionLevels, "]"));
  }
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has coordinates that are not finite");
  }
  if (scheme.triangles && !mesh.triangles()) {
    return absl::InvalidArgumentError(
        absl::StrCat(scheme.name,
                     " takes triangles alone, and the mesh has other polygons; "
                     "catmull-clark and doo-sabin take them"));
  }
  if (scheme.scheme != SubdivisionScheme::kLoop &&
      !(tags.creases.empty() && tags.corners.empty())) {
    return absl::InvalidArgumentError(absl::StrCat(
        scheme.name, " knows no creases and corners; leave them out of the mesh, or take loop"));
  }
  const double corners = static_cast<double>(mesh.corners.size()) * std::pow(scheme.growth, levels);
  if (corners <= static_cast<double>(kMostSubdividedCorners)) return absl::OkStatus();
  return absl::ResourceExhaustedError(
      absl::StrCat("levels = ", levels, " make about ", static_cast<int64_t>(corners),
                   " corners of faces; at most ", kMostSubdividedCorners, " are made"));
}

Eigen::Matrix3Xi FacesOf(const PolygonMesh& mesh) {
  return Eigen::Map<const Eigen::Matrix3Xi>(mesh.corners.data(), 3, mesh.face_count());
}

PolygonMesh Polygons(Eigen::Matrix3Xd vertices, const Eigen::Matrix3Xi& triangles) {
  PolygonMesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.corners.assign(triangles.data(), triangles.data() + triangles.size());
  for (int f = 1; f <= triangles.cols(); ++f) mesh.begin.push_back(3 * f);
  return mesh;
}

// Of the level after the last one: a crease in two halves, one less sharp.
SubdivisionTags TagsAfter(const LoopRefinement& refinement, const SubdivisionTags& tags) {
  SubdivisionTags after{{}, tags.corners};
  if (refinement.sharp.empty()) return after;
  const MeshTopology& topology = refinement.levels.back();
  for (const SharpEdge& edge : refinement.sharp.levels.back().edges) {
    const float left =
        edge.sharpness >= kInfiniteSharpness ? edge.sharpness : edge.sharpness - 1.0f;
    if (left <= 0) continue;
    const int middle = topology.vertex_count + edge.edge;
    for (int end = 0; end < 2; ++end) {
      after.creases.push_back({topology.edge_vertices(end, edge.edge), middle, left});
    }
  }
  SortTags(&after.creases, &after.corners);
  return after;
}

absl::StatusOr<PolygonMesh> SubdivideLoop(const PolygonMesh& mesh, int levels,
                                          const SubdivisionTags& tags, const RunContext& context,
                                          SubdivisionTags* refined) {
  const ControlMesh control{mesh.vertices, FacesOf(mesh), tags.creases, tags.corners};
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement,
                           RefineTopology(control, levels - 1, context));
  Eigen::Matrix3Xd vertices = mesh.vertices;
  for (int level = 0; level < levels; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    vertices = SubdivideOnce(refinement, level, vertices);
  }
  if (refined != nullptr) *refined = TagsAfter(refinement, tags);
  return Polygons(std::move(vertices), RefineFaces(refinement.levels.back()));
}

absl::StatusOr<PolygonMesh> SubdivideTriangles(const PolygonMesh& mesh, SubdivisionScheme scheme,
                                               int levels, const RunContext& context) {
  TriangleMesh now{mesh.vertices, FacesOf(mesh), {}};
  for (int level = 0; level < levels; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(
        const MeshTopology topology,
        BuildMeshTopology(now.triangles, static_cast<int>(now.vertices.cols())));
    if (scheme == SubdivisionScheme::kSqrt3) {
      now = Sqrt3Step(topology, now.vertices, level % 2 == 1);
      continue;
    }
    const Eigen::Matrix3Xd points = ButterflyPoints(topology, now.vertices);
    Eigen::Matrix3Xd all(3, now.vertices.cols() + points.cols());
    all << now.vertices, points;
    now = {std::move(all), RefineFaces(topology), {}};
  }
  return Polygons(std::move(now.vertices), now.triangles);
}

absl::StatusOr<PolygonMesh> SubdividePolygons(PolygonMesh mesh, SubdivisionScheme scheme,
                                              int levels, const RunContext& context) {
  for (int level = 0; level < levels; ++level) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const PolygonTopology topology, BuildPolygonTopology(mesh));
    mesh = scheme == SubdivisionScheme::kCatmullClark ? CatmullClarkStep(mesh, topology)
                                                      : DooSabinStep(mesh, topology);
  }
  return mesh;
}

}  // namespace

absl::StatusOr<SubdivisionScheme> SchemeNamed(absl::string_view name) {
  for (const NamedScheme& scheme : kSchemes) {
    if (scheme.name == name) return scheme.scheme;
  }
  return absl::InvalidArgumentError(absl::StrCat(
      "scheme ", name, ": must be loop, catmull-clark, doo-sabin, butterfly or sqrt3"));
}

absl::StatusOr<PolygonMesh> SubdivideMesh(const PolygonMesh& mesh, SubdivisionScheme scheme,
                                          int levels, const SubdivisionTags& tags,
                                          const RunContext& context, SubdivisionTags* refined) {
  const NamedScheme& named = InfoOf(scheme);
  RILIEVO_RETURN_IF_ERROR(CheckSubdivision(mesh, named, levels, tags));
  // Whatever the scheme and the levels.
  RILIEVO_RETURN_IF_ERROR(BuildPolygonTopology(mesh).status());
  if (refined != nullptr) *refined = tags;
  if (levels == 0) return mesh;
  if (scheme == SubdivisionScheme::kLoop) {
    return SubdivideLoop(mesh, levels, tags, context, refined);
  }
  return named.triangles ? SubdivideTriangles(mesh, scheme, levels, context)
                         : SubdividePolygons(mesh, scheme, levels, context);
}

}  // namespace rilievo
