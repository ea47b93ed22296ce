// The control faces of a scan on disk in parts, whose points fit into memory.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/paging/paged_scan.h"
#include "core/scan/scan_surface.h"
#include "core/surface/displaced_surface.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

struct FacePart {
  std::vector<int> faces;  // ascending
  // Of the points that tell of them: their surface with a halo; unit frame.
  Eigen::AlignedBox3d box;
};

// All parts, each with at most `most_points` points around it where halving the control faces
// comes to that. They depend on the points and on `most_points` alone, never on the memory there
// is.
class FaceParts {
 public:
  // `coarse`: the thinned scan that `surface` and its heights come of; `cutter`: of its control
  // mesh.
  FaceParts(const PagedScan& scan, const ScanSurface& coarse, const DisplacedSurface& surface,
            const PartCutter& cutter, int64_t most_points);

  const std::vector<FacePart>& parts() const { return parts_; }
  // The faces whose surface reaches into the box, ascending.
  std::vector<int> FacesIn(const Eigen::AlignedBox3d& box) const;
  // Where the surface of these faces lies, unit frame.
  Eigen::AlignedBox3d ReachOf(const std::vector<int>& faces) const;

 private:
  std::vector<FacePart> parts_;
  std::vector<Eigen::AlignedBox3d> reach_;  // of each control face
};

}  // namespace rilievo
