// Voxels out: NRRD, OpenVDB, or the numbers alone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/voxels/voxel_bits.h"
#include "core/voxels/voxel_distances.h"

namespace rilievo {

// The numbers of a grid in the order of its voxels, x fastest, in the byte order of this machine.
struct VoxelValues {
  VoxelGrid grid;
  std::string content;  // what they are, one line
  std::string type;     // NRRD's name of their type: "uint8" or "float"
  int bytes = 1;        // of each
  // The next bytes, valid until the next call; asked until there are those of all voxels.
  std::function<absl::StatusOr<std::string_view>()> next;
  // What OpenVDB calls them.
  std::string name = "density", grid_class = "fog volume";
  float background = 0;  // of distances, the band
};

// uint8: 1 for voxels that are set, 0 for the others. `bits` must outlive the values.
VoxelValues ValuesOf(const VoxelBits& bits, std::string content, const RunContext& context);
// float: scan units. `distances` must outlive the values.
VoxelValues ValuesOf(const VoxelDistances& distances, std::string content,
                     const RunContext& context);

// By `extension`: "nrrd" (NRRD0004, raw encoding, one file; space origin is the centre of voxel
// (0, 0, 0) in the scan's frame, `unit` the name of its unit, or empty), "vdb" (see
// voxel_writer_vdb.h) or "raw", which has no header. `progress`: called with the share that is
// written; may be empty. Atomic, see WriteFileAtomically(); errors of `values.next` are returned as
// they are.
absl::Status WriteVoxels(const std::string& path, const std::string& extension,
                         const VoxelValues& values, const std::string& unit,
                         const std::function<void(double share)>& progress);

}  // namespace rilievo
