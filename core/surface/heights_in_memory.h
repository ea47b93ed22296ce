// The heights of a surface in memory, read as those of one that lies elsewhere.
#pragma once

#include <cstddef>
#include <vector>

#include "core/surface/stored_surface.h"

namespace rilievo {

class HeightsInMemory : public FaceHeights {
 public:
  // `control`: topology of the surface's control mesh. Both are kept by reference.
  HeightsInMemory(const DisplacedSurface& surface, const MeshTopology& control)
      : surface_(surface), vertices_(control, surface.max_level) {}

  absl::Status Read(const std::vector<int>& faces, const FaceVertices& here,
                    std::vector<float>* heights,
                    std::vector<HeightSource>* sources) const override {
    heights->assign(static_cast<size_t>(here.count()), 0);
    sources->assign(static_cast<size_t>(here.count()), HeightSource::kFilled);
    std::vector<int> from, to;
    for (size_t f = 0; f < faces.size(); ++f) {
      vertices_.Of(faces[f], from);
      here.Of(static_cast<int>(f), to);
      for (size_t p = 0; p < to.size(); ++p) {
        (*heights)[to[p]] = surface_.heights[from[p]];
        (*sources)[to[p]] = surface_.sources[from[p]];
      }
    }
    return absl::OkStatus();
  }

 private:
  const DisplacedSurface& surface_;
  FaceVertices vertices_;
};

// Keeps references to `surface` and `heights`' own.
inline StoredSurface Stored(const DisplacedSurface& surface, const HeightsInMemory& heights) {
  StoredSurface stored{surface.frame, surface.control_mesh, surface.max_level, &heights, {}};
  for (const HeightSource source : surface.sources) {
    ++stored.source_counts[static_cast<size_t>(source)];
  }
  return stored;
}

}  // namespace rilievo
