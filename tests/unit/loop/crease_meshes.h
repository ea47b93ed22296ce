// Control meshes with creases and corners for the loop tests.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo::testing {

inline void SortCreases(ControlMesh& mesh) {
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
}

// Tags edges a-b, c-d, .. of the list.
inline ControlMesh WithCreases(ControlMesh mesh, const std::vector<std::pair<int, int>>& edges,
                               float sharpness = kInfiniteSharpness) {
  for (const auto& [a, b] : edges) {
    mesh.creases.push_back({std::min(a, b), std::max(a, b), sharpness});
  }
  SortCreases(mesh);
  return mesh;
}

// Every edge with probability `share`, of a sharpness drawn from `sharpness`, and a few corners.
inline ControlMesh WithRandomCreases(ControlMesh mesh, double share,
                                     const std::vector<float>& sharpness, int corner_count,
                                     Random& random) {
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  for (int e = 0; e < topology->edge_count(); ++e) {
    if (random.Signed() > 2.0 * share - 1.0) continue;
    mesh.creases.push_back({topology->edge_vertices(0, e), topology->edge_vertices(1, e),
                            sharpness[random.Below(static_cast<int>(sharpness.size()))]});
  }
  SortCreases(mesh);
  for (int i = 0; i < corner_count; ++i) {
    mesh.corners.push_back(random.Below(static_cast<int>(mesh.vertices.cols())));
  }
  std::sort(mesh.corners.begin(), mesh.corners.end());
  mesh.corners.erase(std::unique(mesh.corners.begin(), mesh.corners.end()), mesh.corners.end());
  return mesh;
}

// The cube [-1, 1]^3 with its twelve edges sharp; two faces a side.
inline ControlMesh SharpCube() {
  ControlMesh cube = Box({-1, -1, -1}, {1, 1, 1});
  for (int a = 0; a < 8; ++a) {
    for (int axis = 1; axis < 8; axis *= 2) {
      if (!(a & axis)) cube.creases.push_back({a, a | axis});
    }
  }
  SortCreases(cube);
  return cube;
}

// A bipyramid whose pole 0, of this valence, has sharp edges to the ring vertices `spokes`.
inline ControlMesh PoleWithSpokes(int valence, const std::vector<int>& spokes, float sharpness,
                                  Random& random) {
  std::vector<std::pair<int, int>> edges;
  for (int spoke : spokes) edges.push_back({0, 2 + spoke});
  return WithCreases(Perturbed(Bipyramid(valence), 0.2, random), edges, sharpness);
}

// A union of poles of valence 3 to 12: every kind of vertex at each.
inline ControlMesh EveryKindAtValences3To12(float sharpness, Random& random) {
  ControlMesh all;
  for (int n = 3; n <= 12; ++n) {
    for (const std::vector<int>& spokes :
         std::vector<std::vector<int>>{{1}, {0, n / 2}, {1, 2}, {0, 1, 2}, {0, n / 3, 2 * n / 3}}) {
      ControlMesh pole = PoleWithSpokes(n, spokes, sharpness, random);
      const int offset = static_cast<int>(all.vertices.cols());
      std::vector<Crease> creases = std::move(all.creases);
      for (const Crease& crease : pole.creases) {
        creases.push_back({crease.a + offset, crease.b + offset, crease.sharpness});
      }
      all = offset > 0 ? Union(all, pole) : pole;
      all.creases = std::move(creases);
    }
  }
  return all;
}

inline std::vector<NamedMesh> CreaseMeshes() {
  Random random(12);
  const auto bent = [&random](ControlMesh mesh, double amount) {
    mesh = Perturbed(std::move(mesh), amount, random);
    mesh.faces = WithShuffledFaces(mesh.faces, random);
    return mesh;
  };
  const std::vector<float> always = {kInfiniteSharpness, std::numeric_limits<float>::infinity()};
  const std::vector<float> half = {0.3f, 0.5f, 1.0f, 1.7f, 2.0f, 2.4f};
  std::vector<float> both = half;
  both.insert(both.end(), always.begin(), always.end());
  // A grid with a crease from boundary to boundary, one that ends inside, and a branch.
  const ControlMesh grid = WithCreases(
      bent(Grid(6, 6), 0.05),
      {{12, 13}, {13, 14}, {14, 15}, {15, 16}, {16, 17}, {14, 20}, {20, 26}, {26, 33}, {4, 10}});
  return {
      {"EveryKindSharp", EveryKindAtValences3To12(kInfiniteSharpness, random)},
      {"EveryKind0p4", EveryKindAtValences3To12(0.4f, random)},
      {"EveryKind1p0", EveryKindAtValences3To12(1.0f, random)},
      {"EveryKind2p3", EveryKindAtValences3To12(2.3f, random)},
      {"GridMeetsBoundary", grid},
      {"RandomSharp", WithRandomCreases(bent(SplitRandomFaces(Icosahedron(), 30, random), 0.05),
                                        0.3, always, 3, random)},
      {"RandomSemiSharp", WithRandomCreases(bent(SplitRandomFaces(Icosahedron(), 30, random), 0.05),
                                            0.3, half, 0, random)},
      {"RandomBoth", WithRandomCreases(bent(SplitRandomFaces(Torus(6, 5), 30, random), 0.05), 0.4,
                                       both, 5, random)},
      {"RandomOpen", WithRandomCreases(bent(SplitRandomFaces(Grid(5, 5), 40, random), 0.03), 0.3,
                                       both, 4, random)},
      {"AllSharp", WithRandomCreases(bent(Icosahedron(), 0.1), 1.0, always, 0, random)},
      {"CornersOnly", WithRandomCreases(bent(Torus(6, 5), 0.05), 0.0, always, 5, random)}};
}

}  // namespace rilievo::testing
