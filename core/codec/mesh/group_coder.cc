#include "core/codec/mesh/group_coder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/range_coder.h"

namespace rilievo {
namespace {

// The groups of the neighbours of a face that come before it, the nearest before first; each once.
struct GroupsBefore {
  std::array<int, 3> groups{};
  int count = 0;

  GroupsBefore(const MeshTopology& control, const std::vector<int>& group_of, int face) {
    std::array<int, 3> faces{};
    for (int side = 0; side < 3; ++side) faces[side] = control.face_neighbors(side, face);
    std::sort(faces.begin(), faces.end(), std::greater<>());
    for (const int neighbor : faces) {
      if (neighbor < 0 || neighbor >= face) continue;
      const auto end = groups.begin() + count;
      if (std::find(groups.begin(), end, group_of[neighbor]) == end) {
        groups[count++] = group_of[neighbor];
      }
    }
  }
};

template <typename Coder>
class GroupCoder {
 public:
  GroupCoder(Coder& coder, const MeshTopology& control, int group_count)
      : coder_(coder), control_(control), bits_(std::bit_width(unsigned(group_count) - 1)) {}

  // `group_of`: a number for each face, of no meaning when decoding.
  void Run(std::vector<int>& group_of) {
    for (int f = 0; f < control_.face_count(); ++f) group_of[f] = CodeFace(group_of, f);
  }

 private:
  int CodeFace(const std::vector<int>& group_of, int face) {
    const GroupsBefore before(control_, group_of, face);
    for (int i = 0; i < before.count; ++i) {
      const std::array<BitModel*, 1> input = {&same_[i][before.count - 1]};
      if (mixer_.Code(coder_, group_of[face] == before.groups[i], input, 255)) {
        return before.groups[i];
      }
    }
    unsigned group = 0;
    for (int bit = bits_ - 1; bit >= 0; --bit) {
      group = 2 * group + (coder_.Code((unsigned(group_of[face]) >> bit & 1) != 0, 32768) ? 1 : 0);
    }
    return static_cast<int>(group);
  }

  Coder& coder_;
  const MeshTopology& control_;
  int bits_;
  std::array<std::array<BitModel, 3>, 3> same_;  // by the question's number and those there may be
  BitMixer<1> mixer_;
};

}  // namespace

std::vector<uint8_t> EncodeGroups(const FaceGroups& groups, const MeshTopology& control) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  writer.Varint(static_cast<uint64_t>(groups.count()));
  RangeEncoder encoder;
  std::vector<int> group_of = groups.group_of;
  GroupCoder<RangeEncoder>(encoder, control, groups.count()).Run(group_of);
  writer.Bytes(encoder.Finish());
  return bytes;
}

absl::StatusOr<FaceGroups> DecodeGroups(std::span<const uint8_t> bytes, const MeshTopology& control,
                                        int limit) {
  ByteReader reader(bytes);
  const uint64_t count = reader.Varint();
  if (!reader.ok() || count < 1 || count > static_cast<uint64_t>(control.face_count())) {
    return absl::DataLossError(
        absl::StrCat("chunk 0 tells of ", count, " groups of ", control.face_count(), " faces"));
  }
  RangeDecoder decoder(reader.Bytes(reader.remaining()));
  std::vector<int> group_of(control.face_count(), 0);
  GroupCoder<RangeDecoder>(decoder, control, static_cast<int>(count)).Run(group_of);
  if (decoder.overrun()) return absl::DataLossError("chunk 0 ends within its groups");
  FaceGroups groups;
  groups.members.resize(count);
  for (int f = 0; f < control.face_count(); ++f) {
    if (group_of[f] >= groups.count()) {
      return absl::DataLossError(
          absl::StrCat("face ", f, " is in group ", group_of[f], " of ", count));
    }
    groups.place_of.push_back(static_cast<int>(groups.members[group_of[f]].size()));
    groups.members[group_of[f]].push_back(f);
  }
  // Halves of more than `limit`.
  const size_t least = count > 1 ? (static_cast<size_t>(limit) + 1) / 2 : 0;
  for (const std::vector<int>& members : groups.members) {
    if (members.size() < least || members.size() > static_cast<size_t>(limit)) {
      return absl::DataLossError(
          absl::StrCat("a group has ", members.size(), " faces, must be ", least, " to ", limit));
    }
  }
  groups.group_of = std::move(group_of);
  return groups;
}

}  // namespace rilievo
