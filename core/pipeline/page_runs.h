// The pages of a scan in runs that fit into memory, each with the points around it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/paging/paged_scan.h"

namespace rilievo {

// Halves that read nearly as much as the whole, as where the halo is most of it, are not worth
// their work.
bool IsWorthHalving(int64_t points, int64_t points_of_larger_half);

// Pages [begin, end).
struct PageRun {
  int begin = 0, end = 0;
  std::vector<int> read;  // these pages and all that may hold points of their halo, ascending
  int64_t points = 0;     // of the run and its halo; an upper bound
};

// How many points the pages of the run have; `size`: all pages.
int64_t PointsOfRun(const PageRun& run, int64_t size);

class PageRuns {
 public:
  // `halo`: what lies so far from a box of a run's stretches belongs to its halo; scan unit.
  // `scan` is kept by reference.
  PageRuns(const PagedScan& scan, double halo);

  // All pages. Runs are halved until they have at most `most_points` points with their halo, as far
  // as halving helps.
  std::vector<PageRun> Cut(int64_t most_points) const;

  // Whether the point of a page outside of the run lies in its halo.
  bool IsAround(const PageRun& run, const Eigen::Vector3d& point) const;

 private:
  using Box = Eigen::AlignedBox3d;

  PageRun RunOf(int begin, int end) const;
  void Split(PageRun run, int64_t most_points, std::vector<PageRun>* runs) const;
  bool IsAround(int begin, int end, const Box& box) const;
  bool Touches(size_t node, const Box& box) const;

  const PagedScan& scan_;
  // The stretches of page p are [first_[p], first_[p + 1]) of all.
  std::vector<size_t> first_;
  // A binary tree: stretch s with its halo is node first_.back() + s, and node n holds what its
  // children 2 n and 2 n + 1 hold. Scan frame.
  std::vector<Box> tree_;
};

}  // namespace rilievo
