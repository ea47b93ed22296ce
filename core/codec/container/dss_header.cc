#include "core/codec/container/dss_header.h"

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/stored_step.h"
#include "core/codec/container/dss_metadata.h"
#include "core/codec/heights/edge_rules.h"
#include "core/codec/mesh/border_coder.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/frame_limit.h"
#include "core/loop/refinement.h"

namespace rilievo {
namespace {

constexpr uint64_t kMaxCount = 1 << 28;
constexpr uint8_t kHasBoundaryFlag = 1;
constexpr uint8_t kHasFilledFlag = 2;
constexpr uint8_t kHasCreasesFlag = 4;
constexpr uint8_t kHasGroupsFlag = 8;
constexpr uint8_t kTellsGroupsFlag = 16;
constexpr uint8_t kHasQuadsFlag = 32;
constexpr uint8_t kHasBorderDigitsFlag = 64;
constexpr int kFirstToTellGroups = 4, kFirstOfQuads = 5, kFirstOfBorderDigits = 6;  // versions

int KnownFlags(int version) {
  return kHasBoundaryFlag | (version > 1 ? kHasFilledFlag | kHasCreasesFlag : 0) |
         (version > 2 ? kHasGroupsFlag : 0) |
         (version >= kFirstToTellGroups ? kTellsGroupsFlag : 0) |
         (version >= kFirstOfQuads ? kHasQuadsFlag : 0) |
         (version >= kFirstOfBorderDigits ? kHasBorderDigitsFlag : 0);
}

}  // namespace

int VersionOf(const DssHeader& header) {
  if (header.border_digits > 0) return kFirstOfBorderDigits;
  if (header.has_quads) return kFirstOfQuads;
  return header.tells_groups ? kFirstToTellGroups : kDssVersion;
}

std::vector<uint8_t> EncodeDssHeader(const DssHeader& header) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  writer.Byte(static_cast<uint8_t>(
      (header.has_boundary ? kHasBoundaryFlag : 0) | (header.has_filled ? kHasFilledFlag : 0) |
      (header.has_creases ? kHasCreasesFlag : 0) | (header.group_limit > 0 ? kHasGroupsFlag : 0) |
      (header.tells_groups ? kTellsGroupsFlag : 0) | (header.has_quads ? kHasQuadsFlag : 0) |
      (header.border_digits > 0 ? kHasBorderDigitsFlag : 0)));
  writer.Varint(static_cast<uint64_t>(header.vertex_count));
  writer.Varint(static_cast<uint64_t>(header.face_count));
  writer.Byte(static_cast<uint8_t>(header.max_level));
  if (header.group_limit > 0) writer.Varint(static_cast<uint64_t>(header.group_limit));
  if (header.border_digits > 0) writer.Byte(static_cast<uint8_t>(header.border_digits));
  for (int axis = 0; axis < 3; ++axis) writer.ShortF64(header.frame.center[axis]);
  writer.ShortF64(header.frame.diagonal);
  writer.ShortF64(StoredStep(header.position_step));
  writer.ShortF64(StoredStep(header.height_unit));
  WriteMetadata(header.metadata, writer);
  return bytes;
}

absl::StatusOr<DssHeader> DecodeDssHeader(std::span<const uint8_t> bytes, int version) {
  ByteReader reader(bytes);
  DssHeader header;
  const uint8_t flags = reader.Byte();
  header.has_boundary = (flags & kHasBoundaryFlag) != 0;
  header.has_filled = version == 1 || (flags & kHasFilledFlag) != 0;
  header.has_creases = version > 1 && (flags & kHasCreasesFlag) != 0;
  header.has_quads = version >= kFirstOfQuads && (flags & kHasQuadsFlag) != 0;
  const uint64_t vertex_count = reader.Varint(), face_count = reader.Varint();
  header.max_level = reader.Byte();
  const bool has_groups = version > 2 && (flags & kHasGroupsFlag) != 0;
  header.tells_groups = has_groups && (flags & kTellsGroupsFlag) != 0;
  const uint64_t group_limit = has_groups ? reader.Varint() : 0;
  const bool has_digits = version >= kFirstOfBorderDigits && (flags & kHasBorderDigitsFlag) != 0;
  header.border_digits = has_digits ? reader.Byte() : 0;
  const auto number = [&] { return version == 1 ? reader.F64() : reader.ShortF64(); };
  for (int axis = 0; axis < 3; ++axis) header.frame.center[axis] = number();
  header.frame.diagonal = number();
  header.position_step = number();
  header.height_unit = number();
  header.metadata = ReadMetadata(reader);
  if (!reader.ok()) return absl::DataLossError("the header ends before its last field");
  if ((flags & ~KnownFlags(version)) != 0 || ((flags & kTellsGroupsFlag) != 0 && !has_groups)) {
    return absl::DataLossError(absl::StrCat("the header has unknown flags, ", flags));
  }
  if (vertex_count < 3 || vertex_count > kMaxCount || face_count < 1 || face_count > kMaxCount) {
    return absl::DataLossError(absl::StrCat("the header counts ", vertex_count, " vertices and ",
                                            face_count, " faces: not possible"));
  }
  if (has_groups && (group_limit < kLeastGroupLimit || group_limit > kMostGroupLimit)) {
    return absl::DataLossError(absl::StrCat("groups of ", group_limit, " faces at most, must be ",
                                            kLeastGroupLimit, " to ", kMostGroupLimit));
  }
  if (has_digits && (!header.has_boundary || header.border_digits < 1 ||
                     header.border_digits > kMostBorderDigits)) {
    return absl::DataLossError(absl::StrCat("the border has ", header.border_digits,
                                            " more digits, must be 1 to ", kMostBorderDigits,
                                            ", of a mesh with a boundary"));
  }
  if (version > kDssVersion && VersionOf(header) != version) {
    return absl::DataLossError(absl::StrCat("the file is of format version ", version,
                                            ", but its header is one of version ",
                                            VersionOf(header)));
  }
  header.group_limit = static_cast<int>(group_limit);
  header.vertex_count = static_cast<int>(vertex_count);
  header.face_count = static_cast<int>(face_count);
  if (version < 3) header.metadata.plain_levels.clear();
  const std::vector<uint8_t>& plain = header.metadata.plain_levels;
  if (plain.size() > static_cast<size_t>(header.max_level) ||
      (!plain.empty() && (header.group_limit > 0 ||
                          *std::max_element(plain.begin(), plain.end()) >= kEdgeRules.size()))) {
    return absl::DataLossError("the header names levels without a chunk that cannot be");
  }
  if (header.max_level > kMaxLoopLevel) {
    return absl::DataLossError(
        absl::StrCat("max_level is ", header.max_level, ", the format ends at ", kMaxLoopLevel));
  }
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!header.frame.center.allFinite() || !positive(header.frame.diagonal) ||
      !positive(header.position_step) || !positive(header.height_unit)) {
    return absl::DataLossError("the header's frame or steps are not finite and positive");
  }
  constexpr double kMostStep = 0.011;  // EncodeOptions allow 0.01, before rounding
  if (header.position_step > kMostStep || header.height_unit > kMostStep ||
      header.frame.diagonal > kMostFrameLength ||
      header.frame.center.cwiseAbs().maxCoeff() > kMostFrameLength) {
    return absl::DataLossError("the header's frame or steps are too large for any surface");
  }
  return header;
}

}  // namespace rilievo
