// The raster under a picture: nearest samples with their shade.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "client/picture/camera.h"
#include "client/picture/image.h"

namespace rilievo {

// Rows of pixels that a thread takes at a time.
inline constexpr int64_t kRowBlock = 64;

struct Raster {
  Raster(int w, int h)
      : width(w),
        height(h),
        nearness(static_cast<size_t>(w) * h, -std::numeric_limits<float>::infinity()),
        color(static_cast<size_t>(w) * h, Eigen::Vector3f::Ones()) {}

  size_t at(int x, int y) const { return static_cast<size_t>(y) * width + x; }

  int width, height;
  std::vector<float> nearness;         // see Projected; -inf where nothing was drawn
  std::vector<Eigen::Vector3f> color;  // linear RGB; white where nothing was drawn
};

// A corner of a triangle on the raster.
struct RasterCorner {
  Projected at;
  Eigen::Vector3f normal;  // view axes
  Eigen::Vector3f color;   // linear RGB
};

// Draws the part of the triangle that lies in rows [row_begin, row_end). `towards`: unit vector to
// the camera, view axes. `back`: seen from behind. The first drawn wins among equally near samples.
void DrawTriangle(const RasterCorner corners[3], const Eigen::Vector3f& towards, bool back,
                  int row_begin, int row_end, Raster* raster);

// Twice the signed area on the raster: positive when counter-clockwise as seen.
float SignedDoubleArea(const Projected& a, const Projected& b, const Projected& c);

// A disc of `radius` samples that faces the camera, unshaded.
void DrawDisc(const Projected& center, float radius, const Eigen::Vector3f& color, int row_begin,
              int row_end, Raster* raster);

// Shade of a surface of linear colour `color` with unit normal `normal` that faces the camera.
Eigen::Vector3f Shade(const Eigen::Vector3f& color, const Eigen::Vector3f& normal,
                      const Eigen::Vector3f& towards);

// Mean of each block of 2 x 2 samples, as sRGB.
Image Downsample(const Raster& raster);

}  // namespace rilievo
