#include "client/formats/laz/layered_chunk.h"

#include <string_view>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/laz/record_fields.h"

namespace rilievo::laz {
namespace {

// In the order of the file. Behind the intensity come scan angles, user data and sources; behind
// the colours near infrared, waveforms and each extra byte.
constexpr size_t kPlace = 0, kZ = 1, kClasses = 2, kFlags = 3, kIntensity = 4, kTimes = 8,
                 kColors = 9;

size_t LayerCount(const LazParameters& parameters) {
  return kColors + (parameters.color_offset > 0 ? 1 : 0) + (parameters.near_infrared ? 1 : 0) +
         (parameters.wave_packet ? 1 : 0) + parameters.extra_bytes;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LayeredChunk>> LayeredChunk::Read(const LazParameters& parameters,
                                                                 const WantedLayers& wanted,
                                                                 const char* first,
                                                                 ByteSource* source) {
  const auto cut_off = [] { return absl::DataLossError("it is cut off; truncated file?"); };
  const size_t layer_count = LayerCount(parameters);
  const char* head = source->Take(4 + 4 * layer_count);
  if (head == nullptr) return cut_off();
  const auto point_count = Load<uint32_t>(head);
  if (point_count == 0) return absl::DataLossError("it says that it has 0 points");
  std::vector<uint64_t> ends;
  uint64_t end = 0;
  for (size_t i = 0; i < layer_count; ++i) {
    ends.push_back(end += Load<uint32_t>(head + 4 + 4 * i));
  }
  const char* bytes = source->MayHold(end) ? source->Take(static_cast<size_t>(end)) : nullptr;
  if (bytes == nullptr) return cut_off();
  const std::string_view layers(bytes, static_cast<size_t>(end));
  const auto layer = [&](size_t index) {
    const uint64_t begin = index == 0 ? 0 : ends[index - 1];
    return layers.substr(static_cast<size_t>(begin), static_cast<size_t>(ends[index] - begin));
  };

  const bool has_more = point_count > 1;  // else the coders have nothing to say
  Point14Layers point;
  if (has_more) {
    point = {.place = layer(kPlace),
             .z = layer(kZ),
             .classes = {},
             .flags = layer(kFlags),
             .intensity = {},
             .times = {}};
    if (!wanted.classes.empty()) point.classes = layer(kClasses);
    if (wanted.intensity) point.intensity = layer(kIntensity);
    if (wanted.trajectory != nullptr) point.times = layer(kTimes);
  }
  std::unique_ptr<LayeredChunk> chunk(new LayeredChunk(point_count, first, point));
  if (wanted.colors && parameters.color_offset > 0) {
    chunk->color_offset_ = parameters.color_offset;
    chunk->colors_.emplace(has_more ? layer(kColors) : std::string_view(), parameters.item_version,
                           Color::LoadFrom(first + parameters.color_offset),
                           chunk->point_.channel());
  }
  return chunk;
}

bool LayeredChunk::Decode(char* record) {
  const bool channel_changed = point_.Decode(record);
  if (!colors_) return !point_.failed();
  colors_->Decode(point_.channel(), channel_changed).StoreTo(record + color_offset_);
  return !point_.failed() && !colors_->failed();
}

}  // namespace rilievo::laz
