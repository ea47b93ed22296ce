#include "server/conversion/parts_request.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/paging/scan_pager.h"

namespace rilievo {
namespace {

// Of a control face, with those on its rim; and of a face of a level that is asked for. One that is
// left to the points is as dense as they are.
constexpr int64_t kScratchBytesOfControlFace = 24, kScratchBytesOfFace = 8;
// Of a control face of a large scan, see ShapeCoarsely().
constexpr int64_t kPointsOfFace = 120;

// What comes of parts: 20 bytes of a point; heights, which are as dense as the points where no
// level is asked for (five bytes each, those on the rims of control faces more than once); and
// distances, four bytes of a point for each part whose reach it is in (up to two). Of a control
// face 72 bytes of its corners, and 45 of the coarse levels each of the dozen times that its
// heights may be coded; what they are coded to is little, and left to what is over of the points.
constexpr int64_t kKeptBytesOfPoint = 40, kKeptBytesOfThinnedPoint = 64,
                  kKeptBytesOfControlFace = 620, kKeptBytesOfFace = 4;

int64_t ControlFacesOf(const JobRequest& job) {
  return std::max(ExpectedControlFaces(job), job.size.points / kPointsOfFace);
}

// Of a level that is asked for; else none.
int64_t FacesAskedFor(const JobRequest& job) {
  if (!job.options.max_level) return 0;
  return std::min(ControlFacesOf(job) << (2 * *job.options.max_level),
                  job.options.max_surface_faces);
}

}  // namespace

std::string ReasonAgainstParts(const JobRequest& job) {
  if (job.size.triangles > 0) return "a mesh is not made by parts";
  if (job.size.base_bytes > 0) return "a surface is not brought up to date by parts";
  const SightOptions& sights = job.options.scan.sights;
  if (sights.stations == SightRule::kUse) return "parts do not use stations; leave them to auto";
  if (sights.normals == SightRule::kUse) return "parts do not use normals; leave them to auto";
  return "";
}

std::string PlacesAloneWarning(bool colors, bool stations, bool normals) {
  std::vector<std::string> left_out;
  if (colors) left_out.emplace_back("colours");
  if (stations) left_out.emplace_back("stations");
  if (normals) left_out.emplace_back("normals");
  if (left_out.empty()) return "";
  return absl::StrCat(
      "The scan is larger than the memory and was made by parts, of the places of its points "
      "alone: its ",
      absl::StrJoin(left_out, ", "), " were not used.");
}

std::string PlacesAloneWarning(const JobRequest& job) {
  const PointLayout& layout = job.size.layout;
  return PlacesAloneWarning(layout.colors, layout.stations, layout.normals);
}

int64_t EstimateScratch(const JobRequest& job) {
  return kScratchBytesOfPoint * std::max<int64_t>(job.size.points, kPagePoints) +
         kScratchBytesOfControlFace * ControlFacesOf(job) +
         kScratchBytesOfFace * FacesAskedFor(job);
}

int64_t EstimateKeptParts(const JobRequest& job) {
  const int64_t thinned = std::min(job.size.points, PartSizes::Of(job.parts->points).coarse_points);
  return kKeptBytesOfPoint * std::max<int64_t>(job.size.points, kPagePoints) +
         kKeptBytesOfThinnedPoint * thinned + kKeptBytesOfControlFace * ControlFacesOf(job) +
         kKeptBytesOfFace * FacesAskedFor(job);
}

}  // namespace rilievo
