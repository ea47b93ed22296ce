// Points as the bytes of PointChunk.data.
#pragma once

#include <cstdint>
#include <string>

#include "core/geometry/point_cloud.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// FLOAT32 when every coordinate survives it unchanged (NaN and infinities do), else FLOAT64.
v1::CoordinateFormat LosslessFormat(const PointCloud& scan);

// Bytes of one point; `format` is one of the two.
int64_t PointBytes(v1::CoordinateFormat format);

// Points [begin, end), x y z, little-endian.
std::string PackPoints(const PointCloud& scan, int64_t begin, int64_t end,
                       v1::CoordinateFormat format);

}  // namespace rilievo
