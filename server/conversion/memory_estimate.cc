#include "server/conversion/memory_estimate.h"

#include <algorithm>

namespace rilievo {
namespace {

constexpr int64_t kProgramBytes = 35'000'000;
constexpr int64_t kBytesOfPoint = 724;
constexpr int64_t kBytesOfFace = 310;  // of the finest level

}  // namespace

int64_t EstimateMemory(const JobRequest& job) {
  // A level that is chosen makes the vertices about as dense as the points.
  int64_t faces = job.point_count * 22 / 10;
  if (job.options.max_level) {
    faces = ExpectedControlFaces(job) << (2 * *job.options.max_level);
  }
  faces = std::min(faces, job.options.max_surface_faces);
  return kProgramBytes + job.point_count * kBytesOfPoint + faces * kBytesOfFace;
}

}  // namespace rilievo
