// A scan thinned by cells that are smaller where its surface bends, ends or has several sheets.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/spatial_frame.h"
#include "core/points/morton_order.h"

namespace rilievo {

// The level from which on two codes of the curve lie in different cells; kMortonBits + 1: none.
inline int FirstLevelApart(uint64_t a, uint64_t b) {
  return a == b ? kMortonBits + 1 : kMortonBits - (63 - std::countl_zero(a ^ b)) / 3;
}

// What a cell holds that one point of it does not tell, as a step of a logarithmic scale: sixteen
// to a factor of two.
using CellDetail = int;

// Hierarchical clustering of points (M. Pauly, M. Gross and L. Kobbelt, Efficient simplification of
// point-sampled surfaces, 2002, section 3.1) over the cells of their Morton curve, top down by one
// limit for the whole scan. A cell is cut into its eight while its detail, or that of a cell in it,
// is above the limit. The detail is the deviation of its points from their plane, times the square
// root of its side, so that noise asks for even cells. Of each cell that is not cut the point
// nearest to its middle is chosen. A cell of few points lies at a border if its plane crosses
// octants without points, more of them than chance explains: above the limit all of its points are
// chosen.
//
// The points come once, in the order of the curve. Memory is that of the chosen points.
class CellThinner {
 public:
  static constexpr CellDetail kMostDetail = 2048;  // no cell has more

  // Cells of level `coarsest` may be cut, down to those of level `deepest`.
  CellThinner(const SpatialFrame& curve, int coarsest, int deepest, CellDetail limit)
      : curve_(curve), coarsest_(coarsest), deepest_(deepest), limit_(limit) {}

  // Scan frame.
  void Add(const Eigen::Vector3d& point);

  // The chosen ones, in order; scan frame.
  Eigen::Matrix3Xd Finish();

  // After Finish(): the least limit with which at most `most` points are chosen, or kMostDetail,
  // which chooses one of each cell of the coarsest level.
  CellDetail LimitFor(int64_t most) const;

 private:
  struct Moments {
    double count = 0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();  // about the mean, summed
    void Add(const Moments& other);
  };
  struct Cell {
    Moments moments;         // of its points, unit frame of the curve
    uint8_t octants = 0;     // bit = an octant that holds points
    CellDetail detail = 0;   // the most of it and of the cells in it
    Eigen::Vector3d middle;  // unit frame
    Eigen::Vector3d chosen;  // nearest to the middle
    double distance = 0;     // from it
    // Where what is known of the points in it begins.
    size_t first_chosen = 0, first_gain = 0, first_recent = 0;
  };
  struct Details {
    CellDetail of_plane = 0;
    CellDetail of_border = 0;  // 0: the cell lies at none
  };
  // `points` more are chosen under limits below `detail`.
  struct Gain {
    CellDetail detail;
    int64_t points;
  };

  Details DetailsOf(const Cell& cell, int level) const;
  void Open(int level, const Eigen::Vector3d& point, const Eigen::Vector3d& unit);
  void Close(int level);
  void GainWholeCell(const Cell& cell, CellDetail detail);

  SpatialFrame curve_;
  int coarsest_, deepest_;
  CellDetail limit_;
  std::vector<Cell> open_;  // that the last point lies in, from the coarsest on
  uint64_t last_code_ = 0;
  std::vector<Eigen::Vector3d> chosen_;
  std::vector<Eigen::Vector3d> recent_;  // of the open cells that may be chosen whole
  std::vector<Gain> recent_gains_;       // of the same
  int64_t coarsest_cells_ = 0;
  std::array<int64_t, kMostDetail + 1> gains_ = {};  // by detail
};

}  // namespace rilievo
