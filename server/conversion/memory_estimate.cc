#include "server/conversion/memory_estimate.h"

#include <algorithm>

namespace rilievo {
namespace {

constexpr int64_t kMostPoints = int64_t{1} << 50;  // no memory holds so many; the sum still fits
constexpr int64_t kProgramBytes = 35'000'000;
constexpr int64_t kBytesOfPoint = 724;
constexpr int64_t kBytesOfFace = 310;  // of the finest level

}  // namespace

int64_t EstimateMemory(const JobRequest& job) {
  const int64_t points = std::min(job.point_count, kMostPoints);
  // A level that is chosen makes the vertices about as dense as the points.
  int64_t faces = points * 22 / 10;
  if (job.options.max_level) {
    faces = ExpectedControlFaces(job) << (2 * *job.options.max_level);
  }
  faces = std::min(faces, job.options.max_surface_faces);
  return kProgramBytes + points * kBytesOfPoint + faces * kBytesOfFace;
}

}  // namespace rilievo
