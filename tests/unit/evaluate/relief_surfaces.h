// Displaced surfaces for the tests of their evaluation.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/loop/quad_meshes.h"

namespace rilievo::testing {

// Waves over the mesh, of the given height, in a frame that is neither unit nor centred.
inline DisplacedSurface WithRelief(ControlMesh mesh, int level, double height) {
  DisplacedSurface surface;
  const LoopRefinement refinement = *RefineTopology(mesh, level, RunContext());
  const LimitSurface limit = *EvaluateLimit(refinement, mesh.vertices, level, RunContext());
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    const Eigen::Vector3d p = limit.positions.col(v);
    surface.heights.push_back(static_cast<float>(
        height * (std::sin(5 * p.x()) + std::sin(6 * p.y() + 1) * std::cos(4 * p.z()))));
  }
  surface.sources.assign(surface.heights.size(), HeightSource::kMeasured);
  surface.control_mesh = std::move(mesh);
  surface.max_level = level;
  surface.frame = {{30, -20, 10}, 4};
  return surface;
}

struct NamedSurface {
  std::string name;
  DisplacedSurface surface;
};

inline std::vector<NamedSurface> ReliefSurfaces() {
  Random random(21);
  // Valences 4 to 7: a valence of 3 bends so sharply that relief folds over there.
  const ControlMesh valences = Perturbed(ConnectedSum(Bipyramid(7), Icosahedron()), 0.03, random);
  const ControlMesh creased =
      WithRandomCreases(valences, 0.3, {kInfiniteSharpness, 1.5f}, 2, random);
  Random diagonals(5);
  return {{"Smooth", WithRelief(valences, 4, 0.01)},
          {"Creased", WithRelief(creased, 4, 0.01)},
          {"Open", WithRelief(Perturbed(Grid(5, 4), 0.05, random), 3, 0.01)},
          {"LevelOne", WithRelief(Torus(8, 6), 1, 0.02)},
          {"LevelZero", WithRelief(Torus(8, 6), 0, 0.02)},
          {"Quads", WithRelief(TurnedTorus(8, 6, diagonals), 3, 0.01)}};
}

}  // namespace rilievo::testing
