// Some control faces of a .dss file without the rest.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/open_dss.h"
#include "core/codec/heights/height_decoder.h"
#include "core/geometry/rgb.h"
#include "core/geometry/spatial_frame.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/height_source.h"
#include "core/surface/region_tessellation.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

struct DecodedRegion {
  RegionMesh region;                  // see there: vertices are those of the whole, ascending
  std::vector<HeightSource> sources;  // one a vertex
  std::vector<Rgb> colors;            // same, or empty
  int level = 0;
  int64_t groups_read = 0, groups = 0;  // 0 groups: the file has none, and all of it was decoded
};

inline constexpr int kFinestLevel = -1;

// The triangles of these control faces at `level`, or the finest that is there, bit for bit
// as DecodeDss() and Tessellate() give them. Of a file with groups (docs/dss-format.md) only the
// control mesh, the two coarsest levels, the indices, and the pieces of the groups within
// kHeightReach + 1 rings of the faces are looked at: anything may stand in the place of the others,
// and their checksums are not asked. `control_faces`: ascending, each once, numbered as in the
// file's control mesh. The errors of DecodeDss() and TessellateRegion().
absl::StatusOr<DecodedRegion> DecodeRegion(std::span<const uint8_t> bytes,
                                           std::span<const int> control_faces, int level,
                                           const RunContext& context);

// Faces at the finest level, with what their triangles, normals and limits depend on.
class PartDecoder {
 public:
  // `file`: opened, with groups and kFirstGroupedLevel + 1 layers or more; `cutter`: of its mesh.
  // Both are kept by reference. The errors of PartHeights.
  static absl::StatusOr<PartDecoder> Open(const OpenedDss& file, const PartCutter& cutter,
                                          const RunContext& context);

  // As DecodeRegion() takes them. For several threads at once.
  absl::StatusOr<SurfacePart> Decode(std::span<const int> control_faces,
                                     const RunContext& context) const;

 private:
  PartDecoder(const OpenedDss& file, const PartCutter& cutter,
              std::unique_ptr<const LoopRefinement> shared, PartHeights heights)
      : file_(file), cutter_(cutter), shared_(std::move(shared)), heights_(std::move(heights)) {}

  const OpenedDss& file_;
  const PartCutter& cutter_;
  std::unique_ptr<const LoopRefinement> shared_;  // the control mesh alone
  PartHeights heights_;
};

// The control faces with a corner of their control triangle, or the triangle's middle, within the
// box (scan frame); for DecodeRegion. The surface lies near its control mesh, not on it.
std::vector<int> ControlFacesInBox(const SpatialFrame& frame, const ControlMesh& mesh,
                                   const Eigen::AlignedBox3d& box);

}  // namespace rilievo
