#include "server/conversion/memory_estimate.h"

#include <algorithm>

namespace rilievo {
namespace {

constexpr int64_t kMostPoints = int64_t{1} << 50;  // no memory holds so many; the sum still fits
constexpr int64_t kProgramBytes = 30'000'000;
constexpr int64_t kBytesOfPoint = 380;
// Of each point beyond so many, from which on neighbours are kept packed (see ScanSurface).
constexpr int64_t kManyPoints = 200'000;
constexpr int64_t kBytesOfFurtherPoint = 250;
constexpr int64_t kBytesOfFace = 100;  // of the finest level

}  // namespace

int64_t EstimateMemory(const JobRequest& job) {
  const int64_t points = std::min(job.point_count, kMostPoints);
  // A level that is chosen makes the vertices about as dense as the points.
  int64_t faces = points * 22 / 10;
  if (job.options.max_level) {
    faces = ExpectedControlFaces(job) << (2 * *job.options.max_level);
  }
  faces = std::min(faces, job.options.max_surface_faces);
  const int64_t first = std::min(points, kManyPoints);
  return kProgramBytes + first * kBytesOfPoint + (points - first) * kBytesOfFurtherPoint +
         faces * kBytesOfFace;
}

}  // namespace rilievo
