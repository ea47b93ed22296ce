// Catmull-Clark surfaces: what RefineTopology(), SubdivideOnce(), EvaluateLimit() and
// BuildLimitStencils() do for a control mesh of quads.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/quad_masks.h"
#include "core/loop/quad_topology.h"
#include "core/loop/refinement.h"
#include "core/loop/subdivision_rules.h"

namespace rilievo {

// The sharp edges of each level, and the limits of sharp control vertices: their `neighbors` are in
// the order of quad_masks.h, their sides in triangles as SharpControlVertex says. SharpLevel lists
// edges alone. Empty where nothing inside is sharp.
SharpRefinement SharpPartsOf(const std::vector<MeshTopology>& levels, const QuadRefinement& quads);

// `level` and the number of columns have been checked.
Eigen::Matrix3Xd SubdivideQuadsOnce(const LoopRefinement& refinement, int level,
                                    const Eigen::Matrix3Xd& values);
absl::StatusOr<LimitSurface> EvaluateQuadLimit(const LoopRefinement& refinement,
                                               const Eigen::Matrix3Xd& control_points, int level,
                                               const RunContext& context);
absl::StatusOr<LimitStencils> BuildQuadStencils(const LoopRefinement& refinement, int level,
                                                const RunContext& context);

// One step of subdivision, vertex by vertex: calls add(vertex of the level, weight). For several
// threads at once, each with a ring of its own.
class QuadStep {
 public:
  QuadStep(const LoopRefinement& refinement, int level)
      : topology_(refinement.levels[level]),
        quads_(refinement.quads.levels[level]),
        rings_(topology_, refinement.quads, level) {}

  template <typename Add>
  void OldVertex(int vertex, QuadRing& ring, const Add& add) const {
    rings_.Of(vertex, ring);
    const std::vector<double> weights = QuadVertexWeights(ring.sharp);
    add(vertex, weights[0]);
    size_t at = 1;
    for (const int neighbor : ring.neighbors) AddUnlessZero(neighbor, weights[at++], add);
    for (const int corner : ring.opposite) AddUnlessZero(corner, weights[at++], add);
  }

  template <typename Add>
  void NewVertex(int edge, const Add& add) const {
    const Quad quad = QuadOfFace(topology_, quads_, topology_.edge_faces(0, edge));
    if (quads_.diagonal[edge] != 0) {
      for (const int corner : quad.vertices) add(corner, 0.25);
      return;
    }
    const int second = topology_.edge_faces(1, edge);
    const double crease = second < 0 ? 1.0 : std::min(quads_.sharpness[edge], 1.0f);
    for (int end = 0; end < 2; ++end) {
      add(topology_.edge_vertices(end, edge), 0.375 + 0.125 * crease);
    }
    if (crease == 1.0) return;
    const auto add_far_corners = [&](const Quad& side) {
      const int i = side.PlaceOfEdge(edge);
      for (const int far : {i + 2, i + 3}) add(side.vertices[far % 4], 0.0625 * (1.0 - crease));
    };
    add_far_corners(quad);
    add_far_corners(QuadOfFace(topology_, quads_, second));
  }

 private:
  template <typename Add>
  static void AddUnlessZero(int vertex, double weight, const Add& add) {
    if (weight != 0.0) add(vertex, weight);
  }

  const MeshTopology& topology_;
  const QuadLevel& quads_;
  QuadRings rings_;
};

// The limit masks of new vertices: those of smooth edges and diagonals, of the boundary, and of
// sharp edges, of which the last is kept.
class NewQuadLimits {
 public:
  NewQuadLimits()
      : inside_(QuadLimit({.sharpness = {0.0f, 0.0f, 0.0f, 0.0f}})),
        boundary_(QuadLimit(
            {.sharpness = {kInfiniteSharpness, 0.0f, kInfiniteSharpness}, .boundary = true})),
        sharp_(inside_) {}

  const SharpLimitMask& Of(bool boundary, float sharpness) {
    if (boundary) return boundary_;
    const float halves = SharpnessOfHalves(sharpness);
    if (halves == 0.0f) return inside_;
    if (halves != halves_) {
      halves_ = halves;
      sharp_ = QuadLimit({.sharpness = {halves, 0.0f, halves, 0.0f}});
    }
    return sharp_;
  }

 private:
  SharpLimitMask inside_, boundary_, sharp_;
  float halves_ = 0.0f;
};

}  // namespace rilievo
