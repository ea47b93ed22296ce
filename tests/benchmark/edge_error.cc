// How well the sharp edges of a ground truth come out, in % of its diagonal, as one line of JSON.
//
//   rilievo_edge_error TRUTH RESULT
//
// near_rms: RMS distance, both ways, of the points of either mesh that lie within 0.5 % of a sharp
// edge of TRUTH, one where its faces meet at 30 degrees or more; edge_rms, edge_p95: distance of
// the points on those edges from RESULT; edge_within: share of them within 0.1 %.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/formats/mesh_reader.h"
#include "core/surface/closest_point_tree.h"
#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kSharpCosine = 0.866, kNear = 0.005, kWithin = 0.001;
constexpr double kSteps = 2000;  // along an edge of a diagonal's length
constexpr int kSamples = 200'000;

struct Mesh {
  Eigen::Matrix3Xd vertices;
  Eigen::Matrix3Xi faces;
  Vector3d Corner(Eigen::Index f, int k) const { return vertices.col(faces(k, f)); }
  Vector3d Cross(Eigen::Index f) const {
    return (Corner(f, 1) - Corner(f, 0)).cross(Corner(f, 2) - Corner(f, 0));
  }
};

using Segment = std::pair<Vector3d, Vector3d>;

// Vertices at the same place count as one: files may hold a vertex once for each face.
std::vector<Segment> SharpEdges(const Mesh& mesh) {
  std::map<std::array<double, 3>, int> ids;
  std::vector<int> id(static_cast<size_t>(mesh.vertices.cols()));
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Vector3d at = mesh.vertices.col(v);
    id[v] = ids.try_emplace({at.x(), at.y(), at.z()}, static_cast<int>(v)).first->second;
  }
  std::map<std::pair<int, int>, std::vector<Eigen::Index>> faces;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax({id[mesh.faces(k, f)], id[mesh.faces((k + 1) % 3, f)]});
      faces[{a, b}].push_back(f);
    }
  }
  std::vector<Segment> edges;
  for (const auto& [ends, beside] : faces) {
    if (beside.size() != 2) continue;
    const Vector3d a = mesh.Cross(beside[0]).normalized(), b = mesh.Cross(beside[1]).normalized();
    if (a.dot(b) > kSharpCosine) continue;
    edges.emplace_back(mesh.vertices.col(ends.first), mesh.vertices.col(ends.second));
  }
  return edges;
}

// Segments as triangles without area.
ClosestPointTree TreeOf(const std::vector<Segment>& segments) {
  Eigen::Matrix3Xd vertices(3, 2 * segments.size());
  Eigen::Matrix3Xi triangles(3, segments.size());
  for (int i = 0; i < triangles.cols(); ++i) {
    vertices.col(2 * i) = segments[i].first;
    vertices.col(2 * i + 1) = segments[i].second;
    triangles.col(i) << 2 * i, 2 * i + 1, 2 * i + 1;
  }
  return ClosestPointTree::Build(vertices, triangles, RunContext()).value();
}

ClosestPointTree TreeOf(const Mesh& mesh) {
  return ClosestPointTree::Build(mesh.vertices, mesh.faces, RunContext()).value();
}

// Mean squared distance to `to` of area-weighted samples of `from` near an edge.
double NearSquare(const Mesh& from, const ClosestPointTree& to, const ClosestPointTree& edges,
                  double diagonal) {
  std::vector<double> area(1, 0);
  for (Eigen::Index f = 0; f < from.faces.cols(); ++f) {
    area.push_back(area.back() + from.Cross(f).norm());
  }
  Random random(12345);
  double squares = 0;
  int count = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double at = random.Uniform(0, area.back());
    const auto above = std::upper_bound(area.begin() + 1, area.end() - 1, at);
    const Eigen::Index f = above - area.begin() - 1;
    const double root = std::sqrt(random.Uniform(0, 1)), share = random.Uniform(0, 1);
    const Vector3d point = (1 - root) * from.Corner(f, 0) +
                           root * ((1 - share) * from.Corner(f, 1) + share * from.Corner(f, 2));
    if (edges.Closest(point).squared_distance > std::pow(kNear * diagonal, 2)) continue;
    squares += to.Closest(point).squared_distance;
    ++count;
  }
  return squares / std::max(1, count);
}

int Main(const std::string& truth_path, const std::string& result_path) {
  std::array<Mesh, 2> meshes;
  for (int i = 0; i < 2; ++i) {
    const std::string& path = i == 0 ? truth_path : result_path;
    auto file = ReadMesh(path);
    if (!file.ok()) {
      std::fprintf(stderr, "rilievo_edge_error: %s\n", file.status().ToString().c_str());
      return 1;
    }
    meshes[i] = {std::move(file->mesh.vertices), std::move(file->mesh.triangles)};
  }
  const auto& [truth, result] = meshes;
  const double diagonal =
      (truth.vertices.rowwise().maxCoeff() - truth.vertices.rowwise().minCoeff()).norm();
  const std::vector<Segment> edges = SharpEdges(truth);
  if (edges.empty()) {
    std::fprintf(stderr, "rilievo_edge_error: %s has no sharp edge\n", truth_path.c_str());
    return 1;
  }
  const ClosestPointTree edge_tree = TreeOf(edges), result_tree = TreeOf(result);
  std::vector<double> distances;
  double squares = 0;
  for (const auto& [a, b] : edges) {
    const int steps = std::max(1, static_cast<int>((b - a).norm() / diagonal * kSteps));
    for (int i = 0; i < steps; ++i) {
      const Vector3d at = a + (i + 0.5) / steps * (b - a);
      squares += result_tree.Closest(at).squared_distance;
      distances.push_back(std::sqrt(result_tree.Closest(at).squared_distance) / diagonal);
    }
  }
  std::sort(distances.begin(), distances.end());
  const auto within = std::upper_bound(distances.begin(), distances.end(), kWithin);
  const double count = static_cast<double>(distances.size());
  const double near = (NearSquare(truth, result_tree, edge_tree, diagonal) +
                       NearSquare(result, TreeOf(truth), edge_tree, diagonal)) /
                      2;
  std::printf(R"({"near_rms":%.6g,"edge_rms":%.6g,"edge_p95":%.6g,"edge_within":%.6g})"
              "\n",
              100 * std::sqrt(near) / diagonal, 100 * std::sqrt(squares / count) / diagonal,
              100 * distances[static_cast<size_t>(0.95 * (count - 1))],
              static_cast<double>(within - distances.begin()) / count);
  return 0;
}

}  // namespace
}  // namespace rilievo

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: rilievo_edge_error TRUTH RESULT\n");
    return 2;
  }
  return rilievo::Main(argv[1], argv[2]);
}
