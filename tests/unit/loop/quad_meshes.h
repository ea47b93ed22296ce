// Control meshes of quads for the loop tests.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "tests/unit/loop/crease_meshes.h"

namespace rilievo::testing {

// Quads as pairs of triangles, each cut along the diagonal that `random` chooses.
inline ControlMesh OfQuads(Eigen::Matrix3Xd vertices, const std::vector<std::array<int, 4>>& quads,
                           Random& random) {
  ControlMesh mesh;
  mesh.vertices = std::move(vertices);
  mesh.faces.resize(3, static_cast<Eigen::Index>(2 * quads.size()));
  Eigen::Index f = 0;
  for (const std::array<int, 4>& quad : quads) {
    const int turn = random.Below(2);
    const int a = quad[turn], b = quad[turn + 1], c = quad[turn + 2], d = quad[(turn + 3) % 4];
    mesh.faces.col(f++) << a, b, c;
    mesh.faces.col(f++) << a, c, d;
    mesh.diagonals.push_back({std::min(a, c), std::max(a, c)});
  }
  mesh.faces = WithShuffledFaces(mesh.faces, random);
  std::sort(mesh.diagonals.begin(), mesh.diagonals.end());
  return mesh;
}

// Each triangle as three quads around its middle; valences and tags of the given vertices stay.
inline ControlMesh InQuads(const ControlMesh& mesh, Random& random) {
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  const int edges = topology->edge_count(), faces = topology->face_count();
  const int first_middle = topology->vertex_count, first_center = first_middle + edges;
  Eigen::Matrix3Xd vertices(3, first_center + faces);
  vertices.leftCols(first_middle) = mesh.vertices;
  for (int e = 0; e < edges; ++e) {
    const auto ends = topology->edge_vertices.col(e);
    vertices.col(first_middle + e) =
        0.5 * (mesh.vertices.col(ends[0]) + mesh.vertices.col(ends[1]));
  }
  std::vector<std::array<int, 4>> quads;
  for (int f = 0; f < faces; ++f) {
    const auto corners = topology->faces.col(f), sides = topology->face_edges.col(f);
    vertices.col(first_center + f) =
        (mesh.vertices.col(corners[0]) + mesh.vertices.col(corners[1]) +
         mesh.vertices.col(corners[2])) /
        3.0;
    for (int k = 0; k < 3; ++k) {
      quads.push_back({corners[k], first_middle + sides[k], first_center + f,
                       first_middle + sides[kPreviousCorner[k]]});
    }
  }
  ControlMesh made = OfQuads(std::move(vertices), quads, random);
  std::map<std::pair<int, int>, int> edge_of;
  for (int e = 0; e < edges; ++e) {
    edge_of[{topology->edge_vertices(0, e), topology->edge_vertices(1, e)}] = e;
  }
  for (const Crease& crease : mesh.creases) {
    const int middle = first_middle + edge_of.at({crease.a, crease.b});
    made.creases.push_back({crease.a, middle, crease.sharpness});
    made.creases.push_back({crease.b, middle, crease.sharpness});
  }
  SortCreases(made);
  made.corners = mesh.corners;
  return made;
}

// A torus of quads; in every third row the edge between two quads is turned, so that valences run
// from 3 to 5. `around` is even.
inline ControlMesh TurnedTorus(int around, int across, Random& random) {
  std::vector<std::array<int, 4>> quads;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const auto at = [&](int di, int dj) {
        return (i + di) % around * across + (j + dj) % across;
      };
      if (j % 3 != 0) {
        quads.push_back({at(0, 0), at(1, 0), at(1, 1), at(0, 1)});
      } else if (i % 2 == 0) {
        quads.push_back({at(0, 0), at(1, 0), at(2, 0), at(0, 1)});
        quads.push_back({at(2, 0), at(2, 1), at(1, 1), at(0, 1)});
      }
    }
  }
  return OfQuads(Torus(around, across).vertices, quads, random);
}

inline std::vector<NamedMesh> QuadMeshes() {
  Random random(41);
  const auto bent = [&random](ControlMesh mesh, double amount) {
    return Perturbed(std::move(mesh), amount, random);
  };
  ControlMesh cube = OfQuads(
      Box({-1, -1, -1}, {1, 1, 1}).vertices,
      {{0, 2, 3, 1}, {0, 1, 5, 4}, {1, 3, 7, 5}, {3, 2, 6, 7}, {2, 0, 4, 6}, {4, 5, 7, 6}}, random);
  ControlMesh one = OfQuads(Grid(2, 2).vertices, {{0, 1, 3, 2}}, random);
  std::vector<NamedMesh> meshes = {{"Cube", bent(cube, 0.1)},
                                   {"OneQuad", bent(one, 0.1)},
                                   {"TurnedTorus", bent(TurnedTorus(6, 6, random), 0.03)}};
  for (const NamedMesh& mesh : LoopMeshes()) {
    if (mesh.name == "Valences3To12" || mesh.name == "SplitGrid" || mesh.name == "Genus2") {
      meshes.push_back({mesh.name, bent(InQuads(mesh.mesh, random), 0.03)});
    }
  }
  for (const NamedMesh& mesh : CreaseMeshes()) {
    // What is between the sharpest and the softest.
    if (mesh.name == "EveryKind0p4" || mesh.name == "EveryKind1p0") continue;
    meshes.push_back({mesh.name, bent(InQuads(mesh.mesh, random), 0.03)});
  }
  return meshes;
}

}  // namespace rilievo::testing
