// Voxels as OpenVDB has them.
#pragma once

#include <functional>
#include <ostream>

#include "absl/status/status.h"
#include "client/formats/voxel_writer.h"

namespace rilievo {

// One grid of floats, file version 224, not compressed: a tree of blocks of 8 x 8 x 8 voxels in
// nodes of 16 and 32 blocks and nodes along each side (K. Museth, "VDB: high-resolution sparse
// volumes with dynamic topology", ACM TOG 32(3), 2013). Blocks whose voxels are all alike are not
// stored. Needs no OpenVDB. Errors of `values.next` are returned as they are.
absl::Status WriteVdb(const VoxelValues& values, const std::function<void(double share)>& progress,
                      std::ostream& out);

}  // namespace rilievo
