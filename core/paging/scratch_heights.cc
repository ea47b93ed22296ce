#include "core/paging/scratch_heights.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {
namespace {

constexpr size_t kVertexBytes = sizeof(float) + 1, kChecksumBytes = sizeof(uint32_t);

}  // namespace

bool AreSources(const std::vector<HeightSource>& sources) {
  return std::all_of(sources.begin(), sources.end(),
                     [](HeightSource source) { return source <= HeightSource::kFilled; });
}

ScratchHeights::ScratchHeights(ScratchFile file, const MeshTopology& control, int level)
    : file_(std::move(file)), control_(control) {
  if (level == 0) return;
  const PatchLattice lattice(level);
  corners_ = lattice.corners();
  sides_ = lattice.sides();
  count_ = static_cast<size_t>(lattice.point_count());
}

absl::StatusOr<ScratchHeights> ScratchHeights::Create(const ScratchFolder& folder,
                                                      const MeshTopology& control, int level) {
  RILIEVO_ASSIGN_OR_RETURN(ScratchFile file, ScratchFile::Create(folder, "heights"));
  const int64_t on_disk = file.BytesOnDisk();
  ScratchHeights heights(std::move(file), control, level);
  RILIEVO_RETURN_IF_ERROR(CheckRoom(folder, control.face_count() * heights.Bytes() - on_disk));
  return heights;
}

int64_t ScratchHeights::Bytes() const {
  return static_cast<int64_t>(count_ * kVertexBytes + kChecksumBytes);
}

absl::Status ScratchHeights::WriteRecord(int face, const Record& record) {
  std::vector<uint8_t> bytes(static_cast<size_t>(Bytes()));
  std::memcpy(bytes.data(), record.heights.data(), count_ * sizeof(float));
  std::memcpy(bytes.data() + count_ * sizeof(float), record.sources.data(), count_);
  const uint32_t checksum = Crc32c(std::span(bytes).first(count_ * kVertexBytes));
  std::memcpy(bytes.data() + count_ * kVertexBytes, &checksum, kChecksumBytes);
  return file_.WriteAt(face * Bytes(), bytes.data(), bytes.size());
}

absl::StatusOr<ScratchHeights::Record> ScratchHeights::ReadRecord(int face) const {
  std::vector<uint8_t> bytes(static_cast<size_t>(Bytes()));
  RILIEVO_RETURN_IF_ERROR(file_.ReadAt(face * Bytes(), bytes.data(), bytes.size()));
  uint32_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + count_ * kVertexBytes, kChecksumBytes);
  if (Crc32c(std::span(bytes).first(count_ * kVertexBytes)) != checksum) {
    return absl::DataLossError(
        absl::StrCat("the heights of control face ", face,
                     " are damaged on the scratch disk; run the command again"));
  }
  Record record{std::vector<float>(count_), std::vector<HeightSource>(count_)};
  std::memcpy(record.heights.data(), bytes.data(), count_ * sizeof(float));
  std::memcpy(record.sources.data(), bytes.data() + count_ * sizeof(float), count_);
  if (!AreSources(record.sources)) {
    return absl::DataLossError(absl::StrCat("the heights of control face ", face,
                                            " are not those of a surface on the scratch disk; run "
                                            "the command again"));
  }
  return record;
}

absl::Status ScratchHeights::Write(int face, const std::vector<float>& heights,
                                   const std::vector<HeightSource>& sources) {
  return WriteRecord(face, {heights, sources});
}

absl::Status ScratchHeights::Finish() {
  source_counts_ = {};
  Record at_corners{std::vector<float>(control_.vertex_count),
                    std::vector<HeightSource>(control_.vertex_count)};
  std::vector<uint8_t> known(control_.vertex_count, 0);
  for (int f = 0; f < control_.face_count(); ++f) {
    RILIEVO_ASSIGN_OR_RETURN(Record record, ReadRecord(f));
    std::vector<uint8_t> own(count_, 1);
    bool changed = false;
    const auto take = [&](int place, const Record& from, int there) {
      changed = changed || record.heights[place] != from.heights[there] ||
                record.sources[place] != from.sources[there];
      record.heights[place] = from.heights[there];
      record.sources[place] = from.sources[there];
      own[place] = 0;
    };
    for (int k = 0; k < 3; ++k) {
      const int v = control_.faces(k, f), place = corners_[k];
      if (known[v] != 0) {
        take(place, at_corners, v);
      } else {
        known[v] = 1;
        at_corners.heights[v] = record.heights[place];
        at_corners.sources[v] = record.sources[place];
      }
      const int neighbor = control_.face_neighbors(k, f);
      if (neighbor < 0 || neighbor > f || sides_[k].empty()) continue;
      RILIEVO_ASSIGN_OR_RETURN(const Record there, ReadRecord(neighbor));
      // Neighbours run along their common side in opposite directions.
      const int side = CornerOfEdge(control_, neighbor, control_.face_edges(k, f));
      const size_t length = sides_[k].size();
      for (size_t i = 0; i < length; ++i) {
        take(sides_[k][i], there, sides_[side][length - 1 - i]);
      }
    }
    if (changed) RILIEVO_RETURN_IF_ERROR(WriteRecord(f, record));
    Count(record.sources, own);
  }
  return absl::OkStatus();
}

void ScratchHeights::Count(const std::vector<HeightSource>& sources,
                           const std::vector<uint8_t>& own) {
  for (size_t p = 0; p < sources.size(); ++p) {
    if (own[p] != 0) ++source_counts_[static_cast<size_t>(sources[p])];
  }
}

absl::Status ScratchHeights::Read(const std::vector<int>& faces, const FaceVertices& here,
                                  std::vector<float>* heights,
                                  std::vector<HeightSource>* sources) const {
  heights->assign(static_cast<size_t>(here.count()), 0.0f);
  sources->assign(static_cast<size_t>(here.count()), HeightSource::kFilled);
  std::vector<int> vertices;
  for (size_t f = 0; f < faces.size(); ++f) {
    RILIEVO_ASSIGN_OR_RETURN(const Record record, ReadRecord(faces[f]));
    here.Of(static_cast<int>(f), vertices);
    for (size_t p = 0; p < vertices.size(); ++p) {
      (*heights)[vertices[p]] = record.heights[p];
      (*sources)[vertices[p]] = record.sources[p];
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo
