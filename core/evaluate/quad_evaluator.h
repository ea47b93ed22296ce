// The limit surface of a Catmull-Clark control mesh at any parameter.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/evaluate/bicubic_patch.h"
#include "core/evaluate/patch_place.h"
#include "core/evaluate/quad_surroundings.h"
#include "core/evaluate/surface_jet.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A regular part of a quad is a bicubic B-spline patch. A quad beside an irregular vertex or a
// semi-sharp edge is cut into quarters, kCutLevels times when this is made and then around the
// parameter asked for, until that lies in a regular one. Stam (1998, "Exact evaluation of
// Catmull-Clark subdivision surfaces at arbitrary parameter values") takes powers of the
// subdivision matrix by its eigenvectors; repeated subdivision gives the same for every crease and
// boundary. Points are relative to a corner of the part, so derivatives lose no digits however
// small it is.
class QuadEvaluator {
 public:
  // Errors as LimitEvaluator::Build().
  static absl::StatusOr<QuadEvaluator> Build(const ControlMesh& mesh, const RunContext& context);
  static constexpr int kCutLevels = 4;

  int face_count() const { return static_cast<int>(faces_.size()); }

  // Of a face, half of a quad, as those of LimitEvaluator.
  PatchPlace Find(int face, double u, double v) const;
  SurfaceJet AtPlace(const PatchPlace& place, JetOrder order) const;

 private:
  friend class QuadTreeBuilder;
  // What is left irregular after all cuts.
  struct Cell {
    ControlMesh mesh;  // the quad and those that touch it
    QuadPart part;
  };
  // A quad cut into the quarters at its corners. Each is a node, or ~(2 p), patch p, or
  // ~(2 c + 1), cell c.
  using Node = std::array<int32_t, 4>;
  struct Face {
    int quad = 0;
    std::array<uint8_t, 3> corners{};  // of the quad, for each corner of the face
  };
  struct ControlQuad {
    int32_t root = 0;
    std::array<int32_t, 4> limits{};  // of its irregular corners, -1 for others
  };

  // Of a face in its quad: (s, t) at its corner 0, and how they grow with u and v.
  struct Sides {
    Eigen::Vector2d start, by_u, by_v;
  };
  Sides SidesOf(const Face& half) const;
  // The number of the irregular corner that (s, t) is at, in `limits_`; -1: at none.
  int32_t CornerAt(const ControlQuad& quad, double s, double t) const;
  // Derivatives in s and t, but for an irregular vertex.
  SurfaceJet AtQuad(const PatchPlace& place, JetOrder order) const;

  std::vector<Face> faces_;
  std::vector<ControlQuad> quads_;
  // Of control vertices, where tangents are those of the control mesh: some vanish on finer levels.
  std::vector<QuadSurroundings::Corner> limits_;
  std::vector<Node> nodes_;
  std::vector<BicubicPatch> patches_;
  std::vector<Cell> cells_;
};

}  // namespace rilievo
