#include "client/formats/laz/color_layer.h"

namespace rilievo::laz {

ColorLayer::ColorLayer(std::string_view layer, int item_version, const Color& first,
                       uint32_t channel)
    : present_(!layer.empty()), keeps_channels_(item_version >= 4), current_(channel) {
  if (present_) decoder_.Start(layer);
  channels_[channel].emplace().last = first;
}

const Color& ColorLayer::Decode(uint32_t channel, bool changed) {
  const uint32_t next = keeps_channels_ || changed ? channel : 0;
  Color* last = &channels_[current_]->last;
  if (next != current_) {
    current_ = next;
    if (!channels_[next]) {
      channels_[next].emplace().last = *last;
      last = &channels_[next]->last;
    } else if (keeps_channels_) {
      last = &channels_[next]->last;
    }
  }
  if (present_) *last = channels_[current_]->models.Decode(&decoder_, *last);
  return *last;
}

}  // namespace rilievo::laz
