// Points in memory, read as those of pages on disk.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "core/surface/point_pages.h"

namespace rilievo {

class PagesInMemory : public PointPages {
 public:
  // `points`: with gaps; so many to a page.
  PagesInMemory(Shape points, int to_a_page) : points_(std::move(points)), to_a_page_(to_a_page) {
    ForgetDistances();
  }

  int count() const override {
    return static_cast<int>((points_.vertices.cols() + to_a_page_ - 1) / to_a_page_);
  }
  Eigen::AlignedBox3d Box(int page) const override {
    Eigen::AlignedBox3d box;
    for (const auto point : Read(page)->vertices.colwise()) box.extend(point);
    return box;
  }
  absl::StatusOr<Shape> Read(int page) const override {
    const Eigen::Index begin = Eigen::Index{page} * to_a_page_;
    const Eigen::Index count = std::min<Eigen::Index>(to_a_page_, points_.vertices.cols() - begin);
    Shape of_page;
    of_page.vertices = points_.vertices.middleCols(begin, count);
    of_page.gaps.assign(points_.gaps.begin() + begin, points_.gaps.begin() + begin + count);
    return of_page;
  }
  absl::StatusOr<std::vector<float>> Distances(int page) const override { return squared_[page]; }
  absl::Status WriteDistances(int page, const std::vector<float>& squared) override {
    squared_[page] = squared;
    return absl::OkStatus();
  }
  void ForgetDistances() override {
    squared_.clear();
    for (int page = 0; page < count(); ++page) {
      squared_.emplace_back(Read(page)->gaps.size(), std::numeric_limits<float>::infinity());
    }
  }

 private:
  Shape points_;
  int to_a_page_;
  std::vector<std::vector<float>> squared_;
};

}  // namespace rilievo
