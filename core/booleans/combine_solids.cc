#include "core/booleans/combine_solids.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/booleans/grid_solid.h"
#include "core/booleans/kept_faces.h"
#include "core/booleans/separate_contacts.h"
#include "core/booleans/solid_crossings.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

struct Plan {
  KeptOutside outside;
  std::array<Growth, 2> growths;  // the second where the first makes a solid overlap itself
};

Plan PlanOf(SolidOperation operation) {
  switch (operation) {
    case SolidOperation::kUnion:
      return {{true, true}, {{{0, kGrowthSteps}, {1, kGrowthSteps}}}};
    case SolidOperation::kIntersection:
      return {{false, false}, {{{0, -kGrowthSteps}, {1, -kGrowthSteps}}}};
    default:
      return {{true, false}, {{{0, -kGrowthSteps}, {1, kGrowthSteps}}}};
  }
}

struct CutSolids {
  SolidCrossings crossings;
  KeptFaces kept;
  std::vector<uint8_t> contacts;  // by corner number, see FindContacts()
};

absl::StatusOr<CutSolids> CutEachOther(const TriangleMesh& a, const TriangleMesh& b,
                                       const KeptOutside& outside, const Growth& growth,
                                       const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const auto solids, PlaceOnGrid(a, b, growth, context));
  CutSolids cut;
  RILIEVO_ASSIGN_OR_RETURN(cut.crossings, FindCrossings(solids, context));
  RILIEVO_ASSIGN_OR_RETURN(cut.kept, KeepFaces(solids, cut.crossings, outside, context));
  if (cut.crossings.all.empty()) return cut;
  RILIEVO_ASSIGN_OR_RETURN(cut.contacts, FindContacts(solids, cut.crossings.all, context));
  if (cut.contacts.empty()) return cut;
  for (const AddedPoint& point : cut.kept.added) {
    cut.contacts.push_back(std::all_of(point.corners.begin(), point.corners.end(), [&](int v) {
      return cut.contacts[static_cast<size_t>(v)] != 0;
    }));
  }
  return cut;
}

// How far along the edge from `tail` to `tip` a crossing lies, which is at `grown` where a solid
// has grown. Growing moves it the farther, the flatter edge and face meet; where they are all but
// parallel it lies nowhere else, and stays.
double ParameterOf(const Eigen::Vector3d& tail, const Eigen::Vector3d& tip,
                   const Eigen::Matrix3d& triangle, double grown, double width) {
  constexpr double kMostMoved = 512;  // contact widths
  const Eigen::Vector3d normal =
      (triangle.col(1) - triangle.col(0)).cross(triangle.col(2) - triangle.col(0));
  const double from = normal.dot(tail - triangle.col(0)), to = normal.dot(tip - triangle.col(0));
  const double parameter = std::clamp(from / (from - to), 0.0, 1.0);
  return std::abs(parameter - grown) * (tip - tail).norm() < kMostMoved * width ? parameter : grown;
}

// By number of KeptFaces: vertices, crossings of the edges as they were given, and added points.
Eigen::Matrix3Xd PlacesOf(const TriangleMesh& a, const TriangleMesh& b,
                          const std::vector<Crossing>& crossings,
                          const std::vector<AddedPoint>& added, double width) {
  const Eigen::Index of_a = a.vertices.cols(), given = of_a + b.vertices.cols();
  const Eigen::Index first_added = given + static_cast<Eigen::Index>(crossings.size());
  Eigen::Matrix3Xd places(3, first_added + static_cast<Eigen::Index>(added.size()));
  places.leftCols(of_a) = a.vertices;
  places.middleCols(of_a, b.vertices.cols()) = b.vertices;
  for (size_t i = 0; i < crossings.size(); ++i) {
    const Crossing& crossing = crossings[i];
    const TriangleMesh &own = crossing.side == 0 ? a : b, &other = crossing.side == 0 ? b : a;
    const Eigen::Vector3d tail = own.vertices.col(Origin(own.triangles, crossing.half_edge));
    const Eigen::Vector3d tip =
        own.vertices.col(Origin(own.triangles, NextHalfEdge(crossing.half_edge)));
    const Eigen::Matrix3d triangle = other.vertices(Eigen::all, other.triangles.col(crossing.face));
    const double parameter = ParameterOf(tail, tip, triangle, crossing.place.parameter(), width);
    places.col(given + static_cast<Eigen::Index>(i)) =
        parameter < 1 ? Eigen::Vector3d(tail + parameter * (tip - tail)) : tip;
  }
  for (size_t i = 0; i < added.size(); ++i) {
    const auto& [corners, weights] = added[i];
    places.col(first_added + static_cast<Eigen::Index>(i)) = weights[0] * places.col(corners[0]) +
                                                             weights[1] * places.col(corners[1]) +
                                                             weights[2] * places.col(corners[2]);
  }
  return places;
}

// What growing makes of a contact is narrower.
double ContactWidth(const TriangleMesh& a, const TriangleMesh& b) {
  constexpr double kContactSteps = 128;
  const Eigen::Vector3d low =
      a.vertices.rowwise().minCoeff().cwiseMin(b.vertices.rowwise().minCoeff());
  const Eigen::Vector3d high =
      a.vertices.rowwise().maxCoeff().cwiseMax(b.vertices.rowwise().maxCoeff());
  return kContactSteps * (high - low).maxCoeff() / (2.0 * kStepsOfHalfBox);
}

// Triangles that grow in number as edges are split.
struct GrowingMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<CutTriangle> triangles;
  std::vector<uint8_t> near_contact;  // by vertex, of those first there

  Eigen::Matrix3Xi Faces() const {
    Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(triangles.size()));
    for (size_t t = 0; t < triangles.size(); ++t) {
      faces.col(static_cast<Eigen::Index>(t)) = Eigen::Vector3i(triangles[t].corners.data());
    }
    return faces;
  }
};

GrowingMesh UsedPart(const KeptFaces& kept, bool turn_second, const Eigen::Matrix3Xd& places,
                     const std::vector<uint8_t>& contacts) {
  GrowingMesh mesh;
  std::vector<int> number(static_cast<size_t>(places.cols()), -1);
  for (size_t side = 0; side < 2; ++side) {
    for (CutTriangle triangle : kept.triangles[side]) {
      if (side == 1 && turn_second) {  // half-edge 0 stays, the others change places
        std::swap(triangle.corners[0], triangle.corners[1]);
        std::swap(triangle.diagonals[1], triangle.diagonals[2]);
      }
      for (int& corner : triangle.corners) {
        int& at = number[static_cast<size_t>(corner)];
        if (at < 0) {
          at = static_cast<int>(mesh.vertices.size());
          mesh.vertices.push_back(places.col(corner));
          mesh.near_contact.push_back(contacts.empty() ? 0 : contacts[static_cast<size_t>(corner)]);
        }
        corner = at;
      }
      mesh.triangles.push_back(triangle);
    }
  }
  return mesh;
}

// Two half-edges of each diagonal that joins the same vertices as another edge does. An edge of a
// loop is never one with another.
std::vector<std::array<uint32_t, 2>> RepeatedDiagonals(const GrowingMesh& mesh) {
  std::vector<std::array<uint32_t, 2>> repeated;
  ForEachEdge(mesh.Faces(), static_cast<int>(mesh.vertices.size()),
              [&](int, int, const HalfEdgeGroup& group) {
                if (group.size() <= 2) return;
                std::vector<std::pair<int, uint32_t>> of_group;
                bool has_loop = false;
                for (size_t i = 0; i < group.size(); ++i) {
                  const int diagonal = mesh.triangles[group[i] / 3].diagonals[group[i] % 3];
                  has_loop = has_loop || diagonal < 0;
                  if (diagonal >= 0) of_group.emplace_back(diagonal, group[i]);
                }
                std::sort(of_group.begin(), of_group.end());
                for (size_t i = has_loop ? 0 : 2; i + 1 < of_group.size(); i += 2) {
                  repeated.push_back({of_group[i].second, of_group[i + 1].second});
                }
              });
  return repeated;
}

void SplitAt(uint32_t half_edge, int middle, GrowingMesh* mesh) {
  const size_t k = half_edge % 3, next = (k + 1) % 3, last = (k + 2) % 3;
  CutTriangle& triangle = mesh->triangles[half_edge / 3];
  CutTriangle behind = triangle;
  behind.corners[k] = middle;
  behind.diagonals[k] = behind.diagonals[last] = -1;
  triangle.corners[next] = middle;
  triangle.diagonals[k] = triangle.diagonals[next] = -1;
  mesh->triangles.push_back(behind);
}

// A manifold has one edge between two vertices: others get a vertex in their middle. A round splits
// a triangle once.
void SplitRepeatedDiagonals(GrowingMesh* mesh) {
  for (;;) {
    const std::vector<std::array<uint32_t, 2>> repeated = RepeatedDiagonals(*mesh);
    if (repeated.empty()) return;
    std::vector<uint8_t> touched(mesh->triangles.size(), 0);
    for (const auto& [h, across] : repeated) {
      if (touched[h / 3] != 0 || touched[across / 3] != 0) continue;
      touched[h / 3] = touched[across / 3] = 1;
      const CutTriangle& triangle = mesh->triangles[h / 3];
      const auto tail = static_cast<size_t>(triangle.corners[h % 3]),
                 tip = static_cast<size_t>(triangle.corners[(h + 1) % 3]);
      const auto middle = static_cast<int>(mesh->vertices.size());
      mesh->vertices.push_back((mesh->vertices[tail] + mesh->vertices[tip]) / 2);
      SplitAt(h, middle, mesh);
      SplitAt(across, middle, mesh);
    }
  }
}

absl::Status CheckInput(const TriangleMesh& mesh, const char* which) {
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("the ", which, " shape has no triangles; solids are combined"));
  }
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError(
        absl::StrCat("the ", which, " shape has a vertex that is not finite"));
  }
  return absl::OkStatus();
}

std::string NothingLeft(SolidOperation operation) {
  return operation == SolidOperation::kDifference
             ? "nothing is left: the first shape lies inside of the second"
             : "nothing is left: the shapes have no volume in common";
}

struct Combination {
  CombinedSolids solids;  // without triangles: nothing is left
  bool touched = false;   // see SeparatedSolids
};

absl::StatusOr<Combination> CombineCut(const TriangleMesh& a, const TriangleMesh& b,
                                       SolidOperation operation, const CutSolids& cut,
                                       const RunContext& context) {
  const double width = ContactWidth(a, b);
  const std::vector<Crossing>& crossings = cut.crossings.all;
  GrowingMesh growing = UsedPart(cut.kept, operation == SolidOperation::kDifference,
                                 PlacesOf(a, b, crossings, cut.kept.added, width), cut.contacts);
  Combination combination;
  if (growing.triangles.empty()) return combination;
  SplitRepeatedDiagonals(&growing);
  CombinedSolids& combined = combination.solids;
  combined.crossings = static_cast<int64_t>(crossings.size());
  combined.cut_faces = cut.kept.cut_faces;
  combined.mesh.triangles = growing.Faces();
  combined.mesh.vertices.resize(3, static_cast<Eigen::Index>(growing.vertices.size()));
  for (size_t v = 0; v < growing.vertices.size(); ++v) {
    combined.mesh.vertices.col(static_cast<Eigen::Index>(v)) = growing.vertices[v];
  }
  if (cut.contacts.empty()) return combination;
  RILIEVO_ASSIGN_OR_RETURN(
      SeparatedSolids separated,
      SeparateContacts(std::move(combined.mesh), std::move(growing.near_contact), width, context));
  combined.mesh = std::move(separated.mesh);
  combination.touched = separated.touched;
  return combination;
}

bool HangTogetherAlike(const TriangleMesh& a, const TriangleMesh& b) {
  const auto summary = [](const TriangleMesh& mesh) {
    return SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
  };
  const TopologySummary of_a = summary(a), of_b = summary(b);
  return of_a.components == of_b.components && of_a.euler == of_b.euler;
}

}  // namespace

absl::StatusOr<CombinedSolids> CombineSolids(const TriangleMesh& a, const TriangleMesh& b,
                                             SolidOperation operation, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckInput(a, "first"));
  RILIEVO_RETURN_IF_ERROR(CheckInput(b, "second"));
  const Plan plan = PlanOf(operation);
  absl::StatusOr<CutSolids> first = CutEachOther(a, b, plan.outside, plan.growths[0], context);
  const bool may_check = first.ok();
  if (absl::IsFailedPrecondition(first.status())) {
    first = CutEachOther(a, b, plan.outside, plan.growths[1], context);
  }
  if (!first.ok()) return first.status();
  RILIEVO_ASSIGN_OR_RETURN(Combination combination,
                           CombineCut(a, b, operation, *std::move(first), context));
  if (combination.touched && may_check) {
    const auto second = CutEachOther(a, b, plan.outside, plan.growths[1], context);
    if (absl::IsCancelled(second.status())) return second.status();
    if (second.ok()) {
      RILIEVO_ASSIGN_OR_RETURN(const Combination other,
                               CombineCut(a, b, operation, *second, context));
      if (!HangTogetherAlike(combination.solids.mesh, other.solids.mesh)) return TouchesTooFlatly();
    }
  }
  if (combination.solids.mesh.triangles.cols() == 0) {
    return absl::FailedPreconditionError(NothingLeft(operation));
  }
  return std::move(combination.solids);
}

}  // namespace rilievo
