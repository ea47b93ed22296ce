// Heights on disk.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/patch_lattice.h"
#include "core/paging/scratch_file.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// Whether each is one of them, as bytes that were read may not be.
bool AreSources(const std::vector<HeightSource>& sources);

// A record for each control face: height and source of each of its vertices (FaceVertices::Of) and
// a checksum. A vertex between faces is in the record of each.
class ScratchHeights : public FaceHeights {
 public:
  // `control` is kept by reference. The errors of ScratchFile, and of CheckRoom() for all heights.
  static absl::StatusOr<ScratchHeights> Create(const ScratchFolder& folder,
                                               const MeshTopology& control, int level);

  size_t vertices_of_face() const { return count_; }

  // Of one face, in the order of FaceVertices::Of; each face once, in any order.
  absl::Status Write(int face, const std::vector<float>& heights,
                     const std::vector<HeightSource>& sources);

  // Whether the record of the face is there as it was written, maybe by an earlier run.
  bool Has(int face) const { return ReadRecord(face).ok(); }

  // Once all faces are written: of a vertex between faces, which may have been found with different
  // halos, the value of the face with the smallest number becomes that of all. May be done
  // once more after some faces have been written anew.
  absl::Status Finish();

  // DATA_LOSS when a record is not what was written.
  absl::Status Read(const std::vector<int>& faces, const FaceVertices& here,
                    std::vector<float>* heights, std::vector<HeightSource>* sources) const override;

  // Vertices of each source, after Finish().
  const std::array<int64_t, 3>& source_counts() const { return source_counts_; }

 private:
  struct Record {
    std::vector<float> heights;
    std::vector<HeightSource> sources;
  };
  ScratchHeights(ScratchFile file, const MeshTopology& control, int level);
  int64_t Bytes() const;
  absl::StatusOr<Record> ReadRecord(int face) const;
  absl::Status WriteRecord(int face, const Record& record);
  void Count(const std::vector<HeightSource>& sources, const std::vector<uint8_t>& own);

  ScratchFile file_;
  const MeshTopology& control_;
  std::array<int, 3> corners_ = {0, 1, 2};  // places in the record
  std::array<std::vector<int>, 3> sides_;   // same, from corner to corner
  size_t count_ = 3;                        // vertices of a record
  std::array<int64_t, 3> source_counts_{};
};

}  // namespace rilievo
