// A growing list of points, of some classes alone where these are wanted, that ends as a matrix
// without a second copy, or goes on to a sink.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/point_layers.h"

namespace rilievo {

class PointCollector {
 public:
  // With a sink nothing is kept: points go to it in blocks.
  explicit PointCollector(const WantedLayers& wanted = {})
      : sink_(wanted.sink),
        some_are_left_out_(wanted.last_returns || !wanted.classes.empty()),
        of_class_(wanted.classes.empty() ? 0 : chosen_.size()) {
    for (const uint8_t number : wanted.classes) chosen_[number] = true;
  }

  // Room for `count` points, or the sink's refusal of them. Only for counts that the bytes at hold
  // really allow.
  absl::Status Reserve(uint64_t count) {
    if (sink_ != nullptr) return sink_->Expect(some_are_left_out_ ? 0 : count);
    if (!some_are_left_out_) Grow(static_cast<Eigen::Index>(count));
    return absl::OkStatus();
  }

  // Of the next point, where the file has classes: whether it is to be added.
  bool Chooses(double number) {
    if (of_class_.empty()) return true;
    const auto known = static_cast<uint8_t>(number >= 0 && number <= 255 ? number : 0);
    ++of_class_[known];
    ++classified_;
    left_out_ += chosen_[known] ? 0 : 1;
    return chosen_[known];
  }

  void Add(double x, double y, double z) {
    if (kept_ == points_.cols()) {
      Grow(sink_ != nullptr ? kBlock : std::max<Eigen::Index>(1024, kept_ + kept_ / 2));
    }
    points_(0, kept_) = x;
    points_(1, kept_) = y;
    points_(2, kept_) = z;
    ++kept_;
    if (sink_ != nullptr && kept_ == kBlock) PassOn();
  }

  int64_t count() const { return passed_on_ + kept_; }
  // With those that Chooses() has left out.
  int64_t offered() const { return count() + left_out_; }
  // Of the sink: why reading ends here.
  const absl::Status& status() const { return status_; }

  // Those that are kept.
  Eigen::Matrix3Xd Finish() {
    if (sink_ != nullptr) PassOn();
    points_.conservativeResize(3, kept_);
    return std::move(points_);
  }
  // By class, of all points that were offered; empty unless each had one.
  std::vector<int64_t> class_counts() const {
    return AllHaveClasses() ? of_class_ : std::vector<int64_t>();
  }

 private:
  static constexpr Eigen::Index kBlock = 1 << 14;

  bool AllHaveClasses() const { return of_class_.empty() || classified_ == offered(); }

  void PassOn() {
    if (status_.ok() && AllHaveClasses()) status_ = sink_->Take(points_.leftCols(kept_));
    passed_on_ += kept_;
    kept_ = 0;
  }

  void Grow(Eigen::Index columns) {
    if (columns > points_.cols()) points_.conservativeResize(3, columns);
  }

  PointSink* sink_;
  absl::Status status_;
  Eigen::Matrix3Xd points_;
  Eigen::Index kept_ = 0;
  int64_t passed_on_ = 0;
  std::array<bool, 256> chosen_{};
  bool some_are_left_out_;
  std::vector<int64_t> of_class_;  // points by class; empty: none is asked for
  int64_t classified_ = 0, left_out_ = 0;
};

}  // namespace rilievo
