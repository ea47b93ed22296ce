// A growing list of points, with their classes, that ends as a matrix without a second copy, or
// goes on to a sink.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/point_layers.h"

namespace rilievo {

class PointCollector {
 public:
  // With a sink nothing is kept: points go to it in blocks.
  explicit PointCollector(PointSink* sink = nullptr) : sink_(sink) {}

  // Room for `count` points, or the sink's refusal of them. Only for counts that the bytes at hold
  // really allow.
  absl::Status Reserve(uint64_t count) {
    if (sink_ != nullptr) return sink_->Expect(count);
    Grow(static_cast<Eigen::Index>(count));
    return absl::OkStatus();
  }

  void Add(double x, double y, double z) {
    if (kept_ == points_.cols()) MakeRoom();
    points_(0, kept_) = x;
    points_(1, kept_) = y;
    points_(2, kept_) = z;
    ++kept_;
  }

  // Of the point that was added last.
  void AddClass(double number) {
    classes_.push_back(number >= 0 && number <= 255 ? static_cast<uint8_t>(number) : 0);
  }

  int64_t count() const { return passed_on_ + kept_; }

  // Those that are kept.
  Eigen::Matrix3Xd Finish() {
    if (sink_ != nullptr) PassOn();
    points_.conservativeResize(3, kept_);
    return std::move(points_);
  }
  // Of each point that is kept, or of some where the file does not have one for each.
  std::vector<uint8_t> TakeClasses() { return std::move(classes_); }

 private:
  static constexpr Eigen::Index kBlock = 1 << 14;

  void MakeRoom() {
    if (sink_ == nullptr) {
      Grow(std::max<Eigen::Index>(1024, kept_ + kept_ / 2));
    } else if (kept_ == kBlock) {
      PassOn();
    } else {
      Grow(kBlock);
    }
  }

  void PassOn() {
    sink_->TakeClasses(classes_);
    classes_.clear();
    sink_->Take(points_.leftCols(kept_));
    passed_on_ += kept_;
    kept_ = 0;
  }

  void Grow(Eigen::Index columns) {
    if (columns > points_.cols()) points_.conservativeResize(3, columns);
  }

  PointSink* sink_;
  Eigen::Matrix3Xd points_;
  std::vector<uint8_t> classes_;
  Eigen::Index kept_ = 0;
  int64_t passed_on_ = 0;
};

}  // namespace rilievo
