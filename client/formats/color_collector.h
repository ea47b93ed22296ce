// The colours of a scan's points, as a reader comes by them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "client/formats/scalar_type.h"
#include "core/base/freed_memory.h"
#include "core/geometry/rgb.h"

namespace rilievo {

class ColorCollector {
 public:
  // How a file stores a channel.
  enum class Kind { kBytes, kIntegers, kReals };
  void set_kind(Kind kind) { kind_ = kind; }
  static Kind KindOf(ScalarType type) {
    if (!IsInteger(type)) return Kind::kReals;
    return ScalarSize(type) == 1 ? Kind::kBytes : Kind::kIntegers;
  }

  // Of the next point: red, green, blue. Where one is not a number the point has no colour.
  void Add(const double* channels) {
    if (!AreNumbers(channels)) unknown_.push_back(count());
    See(channels);
    if (kind_ == Kind::kBytes) {
      bytes_.push_back({Clamped(channels[0]), Clamped(channels[1]), Clamped(channels[2])});
      return;
    }
    std::array<float, 3>& color = wide_.emplace_back();
    for (size_t channel = 0; channel < 3; ++channel) {
      color[channel] = static_cast<float>(channels[channel]);
    }
  }

  // Of a point that is left out: it tells what channels the file has.
  void See(const double* channels) {
    if (kind_ == Kind::kBytes) return;
    const bool known = AreNumbers(channels);
    for (size_t channel = 0; channel < 3; ++channel) {
      whole_ &=
          !known || (channels[channel] >= 0 && channels[channel] == std::floor(channels[channel]));
      if (std::isfinite(channels[channel])) largest_ = std::max(largest_, channels[channel]);
    }
  }

  size_t count() const { return bytes_.size() + wide_.size(); }
  size_t known_count() const { return count() - unknown_.size(); }

  // Whether all that are known, of some points, can be nothing else: whole numbers from 0 to 255,
  // and not 0 and 1 alone.
  bool AreCertain() const { return whole_ && largest_ > 1 && largest_ <= 255; }

  // Of all points; leaves none. Points without a colour take that of the point before them, which
  // is near them in most files. Empty where no point has one, or all are black: that is what
  // programs write into fields that they have nothing for.
  std::vector<Rgb> Finish() {
    const double scale = Scale();
    const double half = IsCut() ? 0 : 0.5;
    bytes_.reserve(bytes_.size() + wide_.size());
    for (const std::array<float, 3>& color : wide_) {
      bytes_.push_back({Clamped(color[0] * scale + half), Clamped(color[1] * scale + half),
                        Clamped(color[2] * scale + half)});
    }
    FreeMemoryOf(&wide_);
    TakeFromBefore();
    if (std::all_of(bytes_.begin(), bytes_.end(),
                    [](const Rgb& color) { return color == Rgb{}; })) {
      bytes_.clear();
    }
    return std::move(bytes_);
  }

 private:
  static bool AreNumbers(const double* channels) {
    return !std::isnan(channels[0] + channels[1] + channels[2]);
  }

  void TakeFromBefore() {
    size_t known = 0;  // the first that is
    while (known < unknown_.size() && unknown_[known] == known) ++known;
    if (known == bytes_.size()) return;  // all are black then
    for (const size_t i : unknown_) bytes_[i] = bytes_[i < known ? known : i - 1];
  }

  // Of longer integers the highest byte counts, as LAS readers do.
  bool IsCut() const { return kind_ == Kind::kIntegers || largest_ > 255; }

  // Formats do not say how much full colour is where a channel is not a byte: programs write 0 to
  // 255 into integers and real numbers too, so the largest value of the file tells.
  double Scale() const {
    if (largest_ > 65535) return 0x1p-24;
    if (largest_ > 255) return 0x1p-8;
    return kind_ == Kind::kReals && largest_ <= 2 ? 255 : 1;
  }

  static uint8_t Clamped(double value) {
    return static_cast<uint8_t>(value >= 255 ? 255 : value > 0 ? value : 0);
  }

  Kind kind_ = Kind::kReals;
  std::vector<Rgb> bytes_;
  std::vector<std::array<float, 3>> wide_;
  std::vector<size_t> unknown_;  // points without a colour, ascending
  double largest_ = 0;           // of the channels
  bool whole_ = true;            // all channels are
};

}  // namespace rilievo
