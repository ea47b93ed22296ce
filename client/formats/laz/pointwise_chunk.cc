#include "client/formats/laz/pointwise_chunk.h"

namespace rilievo::laz {

PointwiseChunk::PointwiseChunk(const LazParameters& parameters, const char* first,
                               ByteSource* source)
    : parameters_(parameters), point_(first), extra_bytes_(parameters.extra_bytes, 256) {
  if (parameters.gps_time) gps_time_.emplace();
  if (parameters.color_offset > 0) {
    colors_.emplace();
    color_ = Color::LoadFrom(first + parameters.color_offset);
  }
  if (parameters.wave_packet) wave_packet_.emplace();
  decoder_.Start(source);
}

bool PointwiseChunk::Decode(char* record) {
  point_.Decode(&decoder_, record);
  if (gps_time_) gps_time_->Skip(&decoder_);
  if (colors_) {
    color_ = colors_->Decode(&decoder_, color_);
    color_.StoreTo(record + parameters_.color_offset);
  }
  if (wave_packet_) wave_packet_->Skip(&decoder_);
  for (uint32_t byte = 0; byte < parameters_.extra_bytes; ++byte) {
    decoder_.Decode(&extra_bytes_[byte]);
  }
  return !decoder_.failed();
}

}  // namespace rilievo::laz
