#include "tests/scans/analytic_shape.h"

#include <cmath>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace rilievo {
namespace {

struct NamedShape {
  const char* name;
  ShapePtr (*make)();
};

constexpr NamedShape kShapes[] = {
    {"sphere", [] { return MakeSphere(); }},       {"torus", [] { return MakeTorus(); }},
    {"genus2", [] { return MakeGenus2(); }},       {"terrain", [] { return MakeTerrain(); }},
    {"cutbox", [] { return MakeCutBox(); }},       {"pair", [] { return MakePair(); }},
    {"star", [] { return MakeStar(); }},           {"bracket", [] { return MakeBracket(); }},
    {"thinwalls", [] { return MakeThinWalls(); }},
};

}  // namespace

double AnalyticShape::Distance(const Eigen::Vector3d& x) const {
  return std::copysign((x - ClosestPoint(x)).norm(), Field(x));
}

Eigen::Vector3d AnalyticShape::Normal(const Eigen::Vector3d& x) const {
  return Gradient(ClosestPoint(x)).normalized();
}

std::vector<std::string> ShapeNames() {
  std::vector<std::string> names;
  for (const NamedShape& shape : kShapes) names.emplace_back(shape.name);
  return names;
}

absl::StatusOr<ShapePtr> MakeShape(absl::string_view name) {
  for (const NamedShape& shape : kShapes) {
    if (name == shape.name) return shape.make();
  }
  return absl::InvalidArgumentError(
      absl::StrCat("no shape is called '", name, "'; known: ", absl::StrJoin(ShapeNames(), ", ")));
}

}  // namespace rilievo
