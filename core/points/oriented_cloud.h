// Points with normals, local spacing and noise: what the later stages know of the scan.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace rilievo {

struct OrientedCloud {
  Eigen::Matrix3Xd points;   // unit frame, Morton order
  Eigen::Matrix3Xd normals;  // unit, pointing outward after OrientNormals
  // Local distance between samples, unit frame: a point's share of the surface is
  // pi/4 * spacing^2 on average.
  std::vector<float> spacing;
  // RMS distance of the neighbours to the local surface, unit frame; bounded by the noise around,
  // so that edges and curvature do not count.
  std::vector<float> noise;
  // 1 where the orientation is ambiguous because what the scanner knows of a side contradicts it
  // or, where that is nothing, the votes of the neighbours contradict each other, as between the
  // sheets of a wall about as thin as its points are apart; empty before OrientNormals.
  std::vector<uint8_t> ambiguous;
  // Where the surface is known to be sharp: columns 2 i and 2 i + 1 are the ends of a segment; unit
  // frame. Of a scan: empty, for nothing is known of it.
  Eigen::Matrix3Xd sharp_lines = {};
  // Of points that were chosen from more: the spacing of all of them in spacings of these. (0, 1].
  double share_of_spacing = 1;
  double median_spacing = 0;  // of `spacing`
  double median_noise = 0;    // of `noise`
};

}  // namespace rilievo
