// The control meshes all loop tests run over.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/loop/refinement.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo::testing {

struct NamedMesh {
  std::string name;
  ControlMesh mesh;
  friend std::ostream& operator<<(std::ostream& out, const NamedMesh& named) {
    return out << named.name;
  }
};

// Closed meshes with valences 3 to 12 and 50, and open ones with boundary valences 2 to 9. Randomly
// bent, so that no symmetry hides an error; face order and first corners shuffled.
inline std::vector<NamedMesh> LoopMeshes() {
  Random random(11);
  const auto bent = [&random](ControlMesh mesh, double amount) {
    mesh = Perturbed(std::move(mesh), amount, random);
    mesh.faces = WithShuffledFaces(mesh.faces, random);
    return mesh;
  };
  ControlMesh valences = Icosahedron();
  for (int n = 3; n <= 12; ++n) valences = Union(valences, bent(Bipyramid(n), 0.2));
  return {{"Tetrahedron", bent(Tetrahedron(), 0.2)},
          {"Octahedron", bent(Bipyramid(4), 0.2)},
          {"Icosahedron", bent(Icosahedron(), 0.1)},
          {"Valences3To12", valences},
          {"Valence50", bent(Bipyramid(50), 0.02)},
          {"Torus", bent(Torus(8, 6), 0.05)},
          {"Genus2", bent(ConnectedSum(Torus(5, 4), Torus(4, 4)), 0.05)},
          {"OpenGrid", bent(Grid(6, 5), 0.1)},
          {"OneFace", bent(HalfFan(1), 0.1)},
          {"SplitSphere", bent(SplitRandomFaces(Icosahedron(), 30, random), 0.05)},
          {"SplitGrid", bent(SplitRandomFaces(Grid(5, 5), 40, random), 0.03)}};
}

inline LoopRefinement Refine(const ControlMesh& mesh, int max_level, int threads = 1) {
  RunContext context;
  context.threads = threads;
  auto refinement = RefineTopology(mesh, max_level, context);
  EXPECT_TRUE(refinement.ok()) << refinement.status();
  return *std::move(refinement);
}

}  // namespace rilievo::testing
