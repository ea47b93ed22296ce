// How much of a .dss stream to read for a surface of few triangles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/codec/bytes/byte_stream.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/container/dss_header.h"

namespace rilievo {

// Bytes up to the end of the last level of at most `most_faces` triangles, all that are there when
// they are no .dss file or have no finer level.
inline size_t ShallowPrefix(std::span<const uint8_t> bytes, int64_t most_faces) {
  const auto list = ListChunks(bytes, false);
  if (!list.ok()) return bytes.size();
  ByteReader reader(list->chunks.front().payload);
  const auto header = DecodeDssHeader(reader.Bytes(reader.Varint()), list->version);
  if (!header.ok()) return bytes.size();
  int level = 0;
  while (level < header->max_level && header->face_count <= most_faces >> (2 * level + 2)) ++level;
  if (level == header->max_level) return bytes.size();
  // Levels without a chunk are those of a whole file, so one chunk at least has to go.
  const int kept = std::min(header->layer_count() - 1, level + 1);
  size_t end = 0;
  int layers = 0;
  for (const Chunk& chunk : list->chunks) {
    if (chunk.tag == kHeightsTag && ++layers > kept) return end;
    end = static_cast<size_t>(chunk.checked.data() - bytes.data()) + chunk.checked.size() + 4;
  }
  return bytes.size();
}

}  // namespace rilievo
