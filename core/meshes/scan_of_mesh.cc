#include "core/meshes/scan_of_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/half_edges.h"
#include "core/geometry/mesh_topology.h"
#include "core/points/morton_order.h"

namespace rilievo {
namespace {

constexpr int64_t kFewestPoints = 100'000;
constexpr double kPiecePoints = 100;
// Of the R2 sequence: powers of the inverse of the plastic number.
constexpr double kPlastic = 1.32471795724474602596;
constexpr double kStepU = 1 / kPlastic, kStepV = 1 / (kPlastic * kPlastic);

// A place on a triangle.
struct Place {
  int triangle;
  Eigen::Vector3d weights;  // of its corners, sum 1
};

std::vector<double> AreasOf(const CheckedMesh& mesh) {
  std::vector<double> areas;
  areas.reserve(static_cast<size_t>(mesh.triangles.cols()));
  for (const auto triangle : mesh.triangles.colwise()) {
    const Eigen::Vector3d origin = mesh.vertices.col(triangle[0]);
    areas.push_back((mesh.vertices.col(triangle[1]) - origin)
                        .cross(mesh.vertices.col(triangle[2]) - origin)
                        .norm() /
                    2);
  }
  return areas;
}

// The integral of both principal curvatures over the surface, whatever their signs: each edge has
// its length times its angle (Cohen-Steiner and Morvan, Restricted Delaunay triangulations and
// normal cycle, 2003). At a border the surface turns back.
double TotalCurvature(const CheckedMesh& mesh) {
  const auto at = [&](uint32_t h) -> Eigen::Vector3d {
    return mesh.vertices.col(Origin(mesh.triangles, h));
  };
  const auto cross = [&](uint32_t h) -> Eigen::Vector3d {
    const Eigen::Vector3d origin = at(h);
    return (at(NextHalfEdge(h)) - origin).cross(at(PreviousHalfEdge(h)) - origin);
  };
  double total = 0;
  ForEachEdge(mesh.triangles, static_cast<int>(mesh.vertices.cols()),
              [&](int low, int high, const HalfEdgeGroup& group) {
                double angle = std::numbers::pi;
                if (group.size() == 2) {
                  const Eigen::Vector3d one = cross(group[0]), other = cross(group[1]);
                  angle = std::atan2(one.cross(other).norm(), one.dot(other));
                }
                total += angle * (mesh.vertices.col(high) - mesh.vertices.col(low)).norm();
              });
  return total;
}

// By triangle, how many times denser than elsewhere its points lie: a small piece has kPiecePoints
// too, or its part of the points where there are so many pieces.
std::vector<double> Densities(const CheckedMesh& mesh, const std::vector<double>& areas,
                              double share) {
  std::vector<int> root(static_cast<size_t>(mesh.vertices.cols()));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (const auto triangle : mesh.triangles.colwise()) {
    for (int k : {1, 2}) root[find(triangle[k])] = find(triangle[0]);
  }
  std::vector<double> area_of(root.size(), 0);
  for (size_t t = 0; t < areas.size(); ++t) area_of[find(mesh.triangles(0, t))] += areas[t];
  const auto pieces = static_cast<double>(
      std::count_if(area_of.begin(), area_of.end(), [](double area) { return area > 0; }));
  const double fewest = std::min(kPiecePoints, static_cast<double>(kFewestPoints) / pieces);
  std::vector<double> densities(areas.size(), 1);
  for (size_t t = 0; t < areas.size(); ++t) {
    const double area = area_of[find(mesh.triangles(0, t))];
    if (area > 0) densities[t] = std::max(1.0, fewest * share / area);
  }
  return densities;
}

// `share`: of the area, each.
void PlaceOverArea(const std::vector<double>& areas, const std::vector<double>& densities,
                   double share, std::vector<Place>* places) {
  double due = 0.5;  // points, of the area so far
  int64_t number = 0;
  for (size_t t = 0; t < areas.size(); ++t) {
    for (due += densities[t] * areas[t] / share; due >= 1; due -= 1) {
      ++number;
      double whole;
      double u = std::modf(0.5 + static_cast<double>(number) * kStepU, &whole);
      double v = std::modf(0.5 + static_cast<double>(number) * kStepV, &whole);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      places->push_back({static_cast<int>(t), {1 - u - v, u, v}});
    }
  }
}

struct Border {
  std::vector<uint32_t> half_edges;
  double length = 0;
};

double LengthOf(const CheckedMesh& mesh, uint32_t h) {
  const auto origin = [&](uint32_t at) { return mesh.vertices.col(Origin(mesh.triangles, at)); };
  return (origin(NextHalfEdge(h)) - origin(h)).norm();
}

Border BorderOf(const CheckedMesh& mesh) {
  Border border;
  ForEachEdge(mesh.triangles, static_cast<int>(mesh.vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                if (group.size() != 1) return;
                border.half_edges.push_back(group[0]);
                border.length += LengthOf(mesh, group[0]);
              });
  return border;
}

double SpacingOf(double share) { return 2 * std::sqrt(share * std::numbers::inv_pi); }

// At most as many as there are already, however long the borders are for the area.
void PlaceAlongBorders(const CheckedMesh& mesh, const Border& border, double spacing,
                       std::vector<Place>* places) {
  const double step = std::max(spacing, border.length / static_cast<double>(places->size() + 1));
  double ahead = step / 2;  // to the next point
  for (const uint32_t h : border.half_edges) {
    const double edge = LengthOf(mesh, h);
    const auto corner = static_cast<int>(h % 3);
    for (; ahead < edge; ahead += step) {
      Place place{static_cast<int>(h / 3), Eigen::Vector3d::Zero()};
      place.weights[corner] = 1 - ahead / edge;
      place.weights[kNextCorner[corner]] = ahead / edge;
      places->push_back(place);
    }
    ahead -= edge;
  }
}

Rgb Between(const std::vector<Rgb>& colors, const Eigen::Vector3i& corners,
            const Eigen::Vector3d& weights) {
  Rgb mixed;
  for (size_t channel = 0; channel < mixed.size(); ++channel) {
    double value = 0;
    for (int k = 0; k < 3; ++k) value += weights[k] * colors[corners[k]][channel];
    mixed[channel] = static_cast<uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
  }
  return mixed;
}

}  // namespace

int64_t FewestPointsOnMesh(int64_t triangles) {
  return std::clamp(triangles, kFewestPoints, kMostPointsOnMesh);
}

int64_t PointsOnMesh(const CheckedMesh& mesh, double most_sagitta) {
  const int64_t fewest = FewestPointsOnMesh(mesh.triangles.cols());
  if (fewest == kMostPointsOnMesh) return fewest;
  // Where the surface turns by t from a point to the next, a spacing s away, the sagitta is t s /
  // 8; the mean of t is the total curvature times s for each area, and a point has pi / 4 s^2 of
  // that.
  const double points = TotalCurvature(mesh) * std::numbers::inv_pi / (2 * most_sagitta);
  return std::max(fewest, static_cast<int64_t>(std::min<double>(points, kMostPointsOnMesh)));
}

absl::StatusOr<ScanSurface> ScanOfMesh(const CheckedMesh& mesh, const std::vector<Rgb>& colors,
                                       int64_t wanted, const RunContext& context) {
  const std::vector<double> areas = AreasOf(mesh);
  const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
  const Border border = BorderOf(mesh);
  double share = area / static_cast<double>(wanted);
  std::vector<double> densities = Densities(mesh, areas, share);
  const auto count_all = [&] {
    const double over_area =
        std::inner_product(areas.begin(), areas.end(), densities.begin(), 0.0) / share;
    return over_area + std::min(over_area, border.length / SpacingOf(share));
  };
  // Borders and small pieces get fewer in a smaller ratio than the rest.
  for (double all = count_all(); all > 1.01 * kMostPointsOnMesh; all = count_all()) {
    share *= all / kMostPointsOnMesh;
    densities = Densities(mesh, areas, share);
  }
  std::vector<Place> places;
  PlaceOverArea(areas, densities, share, &places);
  const double spacing = SpacingOf(share);
  PlaceAlongBorders(mesh, border, spacing, &places);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());

  const auto count = static_cast<int64_t>(places.size());
  Eigen::Matrix3Xd points(3, count);
  for (int64_t i = 0; i < count; ++i) {
    const Place& place = places[i];
    points.col(i) = mesh.vertices(Eigen::all, mesh.triangles.col(place.triangle)) * place.weights;
  }
  RILIEVO_ASSIGN_OR_RETURN(const MortonOrder morton, ComputeMortonOrder(points, context));
  OrientedCloud cloud;
  cloud.points = points(Eigen::all, morton.order);
  cloud.normals.resize(3, count);
  std::vector<Rgb> mixed;
  for (int64_t i = 0; i < count; ++i) {
    const Place& place = places[morton.order[i]];
    const Eigen::Vector3i corners = mesh.triangles.col(place.triangle);
    const Eigen::Vector3d origin = mesh.vertices.col(corners[0]);
    cloud.spacing.push_back(static_cast<float>(spacing / std::sqrt(densities[place.triangle])));
    cloud.normals.col(i) = (mesh.vertices.col(corners[1]) - origin)
                               .cross(mesh.vertices.col(corners[2]) - origin)
                               .normalized();
    if (!colors.empty()) mixed.push_back(Between(colors, corners, place.weights));
  }
  cloud.spacing.reserve(static_cast<size_t>(count));
  cloud.noise.assign(static_cast<size_t>(count), 0.0f);
  cloud.ambiguous.assign(static_cast<size_t>(count), 0);
  cloud.median_spacing = spacing;
  RILIEVO_ASSIGN_OR_RETURN(PointIndex index, PointIndex::Build(cloud.points, context));
  ScanFigures figures;
  figures.kept = count;
  return ScanSurface{std::move(cloud), std::move(mixed), NeighborGraph(),
                     std::move(index), mesh.frame,       figures};
}

}  // namespace rilievo
