// The nearest points of places that follow each other closely, from points asked for together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/points/point_index.h"

namespace rilievo {

// Answers as the index does, in a third of its time where most places lie within a few points of
// those before them. One for each thread.
class BatchedNearest {
 public:
  // `points`: those of the index; both are kept by reference. `k`: of each place, from 1
  // to index.size().
  BatchedNearest(const PointIndex& index, const Eigen::Matrix3Xd& points, int k);

  // Calls found(i, indices, squared_distances) for each of the columns [begin, end) of `places` in
  // turn: its k nearest points, ascending by distance.
  template <typename Found>
  void OfEach(const Eigen::Matrix3Xd& places, int64_t begin, int64_t end, const Found& found) {
    for (int64_t i = begin; i < end;) {
      for (const int64_t run_end = Gather(places, i, end); i < run_end; ++i) {
        Find(places.col(i));
        found(i, static_cast<const int*>(indices_.data()),
              static_cast<const double*>(squared_.data()));
      }
    }
  }

 private:
  // Gathers what the places of a run from `begin` on may be near to. Returns the end of the run.
  int64_t Gather(const Eigen::Matrix3Xd& places, int64_t begin, int64_t end);
  void Find(const Eigen::Vector3d& place);
  // Among the points gathered. False when those might not be all.
  bool FindGathered(const Eigen::Vector3d& place);
  // Of the gathered points within a squared distance; how many there are.
  int Shortlist(double most_squared);
  void SortShortlist(int count);

  const PointIndex& index_;
  const Eigen::Matrix3Xd& points_;
  const int k_;
  double reach_ = 0;  // of the place before, to its farthest point
  std::vector<int> indices_;
  std::vector<double> squared_;
  // All points within a radius of a middle; none when it is negative.
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  double radius_ = -1;
  std::vector<int> gathered_;
  std::vector<double> coordinates_[3], distances_;  // filled up to a multiple of the lanes
  std::vector<int> listed_;
  std::vector<double> listed_distances_;
  std::vector<int64_t> ranks_;
};

}  // namespace rilievo
