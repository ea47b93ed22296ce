#include "client/formats/laz/point14_decoder.h"

#include "client/formats/las_header.h"
#include "client/formats/laz/place_decoder.h"
#include "client/formats/laz/record_fields.h"
#include "client/formats/laz/return_contexts.h"

namespace rilievo::laz {
namespace {

// Bits of the symbol that says what changed; below them two bits for the number of the return.
constexpr uint32_t kCountChanged = 4;
constexpr uint32_t kTimeChanged = 16;
constexpr uint32_t kChannelChanged = 64;

}  // namespace

struct Point14Decoder::Channel {
  Channel(const Point& before, uint64_t time)
      : last(before), place(before.z), times(time, GpsTimeDecoder::Repeats::kAreLeftOut) {
    last_intensities.fill(before.intensity);
  }

  Point last;
  bool time_changed = false;
  ContextModels changed{8, 128}, counts{16, 16}, numbers{16, 16}, classes{64, 256}, flags{64, 64};
  SymbolModel channels{3}, numbers_of_same_time{13};
  PlaceDecoder place;
  IntegerDecoder intensities{16, 4};
  std::array<uint16_t, 8> last_intensities;
  GpsTimeDecoder times;
};

Point14Decoder::Point14Decoder(const char* first, const Point14Layers& layers)
    : place_(layers.place),
      z_(layers.z),
      classes_(layers.classes),
      flags_(layers.flags),
      intensity_(layers.intensity),
      times_(layers.times) {
  const uint32_t returns = Load<uint8_t>(first + 14), flags = Load<uint8_t>(first + 15);
  channel_ = (flags >> 4) & 3;
  channels_[channel_] =
      std::make_unique<Channel>(Point{.x = Load<uint32_t>(first),
                                      .y = Load<uint32_t>(first + 4),
                                      .z = Load<uint32_t>(first + 8),
                                      .intensity = Load<uint16_t>(first + 12),
                                      .number = returns & 15,
                                      .count = returns >> 4,
                                      .flags = (flags & 15) | (flags >> 2 & 48),
                                      .classification = Load<uint8_t>(first + 16)},
                                Load<uint64_t>(first + kLasTimeOffsets[6]));
}

Point14Decoder::~Point14Decoder() = default;

bool Point14Decoder::failed() const {
  return place_.decoder.failed() || z_.decoder.failed() || classes_.decoder.failed() ||
         flags_.decoder.failed() || intensity_.decoder.failed() || times_.decoder.failed();
}

bool Point14Decoder::at_end() const {
  return place_.decoder.at_end() && z_.decoder.at_end() && classes_.decoder.at_end() &&
         flags_.decoder.at_end() && intensity_.decoder.at_end() && times_.decoder.at_end();
}

void Point14Decoder::DecodeReturn(Channel* channel, uint32_t changed) {
  ArithmeticDecoder* decoder = &place_.decoder;
  Point& point = channel->last;
  if ((changed & kCountChanged) != 0) {
    point.count = decoder->Decode(&channel->counts[point.count]);
  }
  switch (changed & 3) {
    case 0:
      break;
    case 1:
      point.number = (point.number + 1) & 15;
      break;
    case 2:
      point.number = (point.number - 1) & 15;
      break;
    default:
      if ((changed & kTimeChanged) != 0) {
        point.number = decoder->Decode(&channel->numbers[point.number]);
      } else {
        point.number = (point.number + decoder->Decode(&channel->numbers_of_same_time) + 2) & 15;
      }
  }
}

bool Point14Decoder::Decode(char* record) {
  Channel* channel = channels_[channel_].get();
  const uint32_t return_before = (channel->last.number == 1 ? 1 : 0) |
                                 (channel->last.number >= channel->last.count ? 2 : 0) |
                                 (channel->time_changed ? 4 : 0);
  const uint32_t changed = place_.decoder.Decode(&channel->changed[return_before]);
  const bool channel_changed = (changed & kChannelChanged) != 0;
  if (channel_changed) {
    channel_ = (channel_ + place_.decoder.Decode(&channel->channels) + 1) & 3;
    if (!channels_[channel_]) {
      channels_[channel_] = std::make_unique<Channel>(channel->last, channel->times.last());
    }
    channel = channels_[channel_].get();
  }
  channel->time_changed = (changed & kTimeChanged) != 0;
  DecodeReturn(channel, changed);

  Point& point = channel->last;
  const uint32_t single = point.count == 1 ? 1 : 0, time_changed = channel->time_changed ? 1 : 0;
  channel->place.MoveXY(&place_.decoder,
                        kFewReturnContexts(point.count, point.number) << 1 | time_changed, single,
                        &point.x, &point.y);
  if (z_.present) {
    point.z = channel->place.DecodeZ(&z_.decoder, kReturnLevels(point.count, point.number), single);
  }
  if (classes_.present) {
    const uint32_t only = point.number == 1 && point.number >= point.count ? 1 : 0;
    point.classification =
        classes_.decoder.Decode(&channel->classes[(point.classification & 31) << 1 | only]);
  }
  if (flags_.present) point.flags = flags_.decoder.Decode(&channel->flags[point.flags]);
  if (intensity_.present) {
    const uint32_t first_last = (point.number == 1 ? 2 : 0) | (point.number >= point.count ? 1 : 0);
    point.intensity = channel->last_intensities[first_last << 1 | time_changed] +=
        static_cast<uint16_t>(channel->intensities.Decode(&intensity_.decoder, first_last));
  }
  if (times_.present && channel->time_changed) channel->times.Decode(&times_.decoder);

  Store(point.x, record);
  Store(point.y, record + 4);
  Store(point.z, record + 8);
  Store(point.intensity, record + 12);
  Store(static_cast<uint8_t>(point.number | point.count << 4), record + 14);
  Store(static_cast<uint8_t>((point.flags & 15) | channel_ << 4 | (point.flags & 48) << 2),
        record + 15);
  Store(static_cast<uint8_t>(point.classification), record + 16);
  Store(channel->times.last(), record + kLasTimeOffsets[6]);
  return channel_changed;
}

}  // namespace rilievo::laz
