// The vertices of one refinement level, control face by control face.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/loop/patch_lattice.h"

namespace rilievo {

// The vertices that a level has on each control face, in an order that depends on the level alone:
// the way from a vertex of a cut-out part (sub_mesh.h) to the same vertex of the whole.
class FaceVertices {
 public:
  // `control` is kept by reference. level in [0, 8].
  FaceVertices(const MeshTopology& control, int level) : control_(control) {
    if (level == 0) return;
    lattice_.emplace(level);
    numbering_.emplace(control, *lattice_);
  }
  FaceVertices(const FaceVertices&) = delete;
  FaceVertices& operator=(const FaceVertices&) = delete;

  int64_t count() const { return numbering_ ? numbering_->vertex_count() : control_.vertex_count; }
  // Replaces what `vertices` holds.
  void Of(int face, std::vector<int>& vertices) const {
    if (numbering_) {
      numbering_->VerticesOf(face, vertices);
    } else {
      vertices = {control_.faces(0, face), control_.faces(1, face), control_.faces(2, face)};
    }
  }
  // Places in that order of the vertices inside side `side`, from corner to corner; level > 0.
  const std::vector<int>& Side(int side) const { return lattice_->sides()[side]; }

 private:
  const MeshTopology& control_;
  std::optional<PatchLattice> lattice_;
  std::optional<PatchNumbering> numbering_;
};

}  // namespace rilievo
