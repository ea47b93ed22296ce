#include "client/cli/time_left.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace rilievo {

// The work is about microseconds of two threads, as measured on a torus of one and of ten million
// points; what counts are the ratios.
TimeLeft::TimeLeft(int64_t points, int64_t thinned_points) {
  const auto all = static_cast<double>(points), thinned = static_cast<double>(thinned_points);
  // A scan that is thinned is asked for outliers first.
  const double outliers = points > thinned_points ? 5 * all : 0;
  steps_ = {{v1::STAGE_CHECK, 0.7 * thinned + outliers},
            {v1::STAGE_NEIGHBORS, 1.7 * thinned},
            {v1::STAGE_NORMALS, 7 * thinned},
            {v1::STAGE_CONTROL_MESH, 10 * thinned},
            {v1::STAGE_DOMAIN_FIT, 1.5 * thinned},
            {v1::STAGE_DISPLACEMENT, thinned},
            {v1::STAGE_DISPLACEMENT, 35 * all},
            {v1::STAGE_MEASURE, 1.5 * all},
            {v1::STAGE_ENCODE, 12 * all},
            {v1::STAGE_MEASURE, 5 * all}};
}

std::optional<double> TimeLeft::After(v1::Stage stage, double fraction, double seconds) {
  if (!at_ || steps_[*at_].stage != stage || fraction < fraction_) {
    // The step that follows, or where an earlier run has done some the last one of this stage.
    const size_t following = at_ ? *at_ + 1 : 0;
    size_t next = following;
    if (next == steps_.size()) return std::nullopt;
    if (steps_[next].stage != stage) {
      next = steps_.size() - 1;
      while (next > following && steps_[next].stage != stage) --next;
      if (next == following) return std::nullopt;
    }
    if (at_) done_ += steps_[*at_].work * (fraction_ - begun_fraction_);
    at_ = next;
    begun_fraction_ = fraction;
  }
  fraction_ = fraction;
  const Step& step = steps_[*at_];
  const double done = done_ + step.work * (fraction_ - begun_fraction_);
  double left = step.work * (1 - fraction_);
  for (size_t later = *at_ + 1; later < steps_.size(); ++later) left += steps_[later].work;
  constexpr double kTellingShare = 0.03, kTellingSeconds = 3;
  if (done < kTellingShare * (done + left) || seconds < kTellingSeconds) return std::nullopt;
  return seconds * left / done;
}

std::string TimeLeftText(double seconds) {
  constexpr double kMinute = 60, kHour = 3600;
  const auto about = [](double count, const char* unit) {
    return absl::StrCat("about ", std::max<int64_t>(1, std::lround(count)), " ", unit, " left");
  };
  if (seconds < 1.5 * kMinute) return about(seconds, "s");
  if (seconds < 1.5 * kHour) return about(seconds / kMinute, "min");
  return about(seconds / kHour, "h");
}

}  // namespace rilievo
