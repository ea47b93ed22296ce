#include "server/conversion/memory_estimate.h"

#include <gtest/gtest.h>

#include <optional>

namespace rilievo {
namespace {

struct Measured {
  const char* scan;
  int64_t points;
  double peak_megabytes;  // of a worker with two threads
  double most = 1.3;      // estimates over it
  int control_faces = 0;
  Topology topology = Topology::kAuto;
  int mesh_faces = 0;
  std::optional<int> max_level = {};
  int sample_level = 2;
  int neighbors = 16;
};

// Peaks as the system tells them. The coefficients were fitted to other requests of the same kinds.
const Measured kMeasured[] = {
    {"torus", 300, 18.5},
    {"torus", 2000, 18.6, 1.4},
    {"torus", 20'000, 27.4, 1.7},
    {"plane", 100'000, 77.0, 1.4},
    {"torus", 20'000, 26.5, 1.7, 0, Topology::kAuto, 0, {}, 1},
    {"plane", 20'000, 64.5, 1.7, 5'000, Topology::kPlanar},
    {"plane", 20'000, 221.3, 1.3, 80'000, Topology::kPlanar},
    {"plane", 100'000, 535.6, 1.3, 200'000, Topology::kPlanar},
    {"sphere", 2'000, 36.9, 1.3, 8'000, Topology::kSpherical},
    {"sphere", 20'000, 344.7, 1.3, 80'000, Topology::kSpherical},
    {"torus", 20, 131.2, 1.3, 0, Topology::kUser, 45'000},
    {"torus", 2'000, 34.3, 1.3, 0, Topology::kUser, 7'200},
    {"torus", 20'000, 270.3, 1.3, 0, Topology::kUser, 96'800},
    {"torus", 2'000, 264.6, 1.3, 0, Topology::kUser, 96'800, {}, 4},
    {"torus", 200'000, 100.4, 1.7},
    {"torus", 1'000'000, 278.4, 1.8},
    {"torus", 3'000'000, 770.0, 1.8, 0, Topology::kAuto, 0, 3},
    {"torus", 10'000'000, 3342.6, 1.3, 12'000},
    {"torus", 100'000, 109.8, 1.5, 0, Topology::kAuto, 0, {}, 2, 64},
    {"torus", 20'000, 30.3, 2.5, 0, Topology::kAuto, 0, {}, 2, 6},
    // Mostly filled in.
    {"torus", 2'000, 46.4, 1.5, 0, Topology::kAuto, 0, 5},
    {"plane", 2'000, 138.3, 1.5, 0, Topology::kAuto, 0, 6},
    {"torus", 2'000, 480.2, 1.6, 0, Topology::kAuto, 0, 7},
    {"torus", 20'000, 120.6, 1.5, 0, Topology::kAuto, 0, 5},
    {"torus", 2'000, 1112.6, 1.5, 0, Topology::kUser, 7'200, 5},
};

// Whose implicit function has nearly all the nodes that it may have, or whose control mesh is
// crumpled.
const Measured kHungry[] = {
    {"two spheres a spacing apart", 40'000, 70.2, 1.3, 8, Topology::kArbitrary},
    {"curves", 6'000, 32.2},
    {"curves", 20'000, 35.8},
    {"curves", 100'000, 82.2},
    {"thin walls", 2'000, 25.9},
    {"thin walls", 20'000, 39.4},
    {"rooms", 100'000, 115.8},
    {"volume", 20'000, 79.2, 1.3, 0, Topology::kAuto, 0, {}, 2, 6},
};

JobRequest RequestOf(const Measured& measured) {
  JobRequest job;
  job.size.points = measured.points;
  job.options.max_level = measured.max_level;
  job.options.fit.sample_level = measured.sample_level;
  job.options.scan.neighbors.k = measured.neighbors;
  job.options.control.topology = measured.topology;
  job.options.control.target_faces = measured.control_faces;
  if (measured.mesh_faces > 0) {
    job.options.control.user_mesh.emplace().faces.resize(3, measured.mesh_faces);
  }
  return job;
}

TEST(MemoryEstimate, IsWhatWorkersTook) {
  for (const Measured& measured : kMeasured) {
    SCOPED_TRACE(testing::Message() << measured.scan << ", " << measured.points << " points, "
                                    << measured.control_faces + measured.mesh_faces << " faces");
    const auto estimate = static_cast<double>(EstimateMemory(RequestOf(measured))) / 1e6;
    EXPECT_GT(estimate, measured.peak_megabytes);
    EXPECT_LT(estimate, measured.most * measured.peak_megabytes);
  }
}

TEST(MemoryEstimate, IsNearWhatTheHungriestTook) {
  for (const Measured& measured : kHungry) {
    SCOPED_TRACE(testing::Message() << measured.scan << ", " << measured.points << " points");
    const auto estimate = static_cast<double>(EstimateMemory(RequestOf(measured))) / 1e6;
    EXPECT_LT(measured.peak_megabytes, 1.2 * estimate);
    EXPECT_LT(estimate, measured.most * measured.peak_megabytes);
  }
}

// Twenty points do not ask for half a gigabyte, whatever number stands in the request.
TEST(MemoryEstimate, FacesThatAreNotMadeAreNotReserved) {
  JobRequest job;
  job.size.points = 20;
  const int64_t before = EstimateMemory(job);
  job.options.control.target_faces = 200'000;
  EXPECT_EQ(EstimateMemory(job), before);
}

struct MeasuredMesh {
  int64_t vertices, triangles;
  double peak_megabytes;
};

// Of those that take the most points: a gear of fine teeth, a rough torus, a head of eight pieces;
// and of even triangles.
const MeasuredMesh kMeasuredMeshes[] = {
    {4'800, 9'600, 157.9},     {48'000, 96'000, 148.5},     {64'215, 117'694, 152.9},
    {150'152, 300'304, 156.9}, {500'000, 1'000'000, 222.4}, {2'000'000, 4'000'000, 727.5},
};

TEST(MemoryEstimate, OfMeshesToo) {
  for (const MeasuredMesh& measured : kMeasuredMeshes) {
    SCOPED_TRACE(testing::Message() << measured.triangles << " triangles");
    JobRequest job;
    job.size.points = measured.vertices;
    job.size.triangles = measured.triangles;
    const auto estimate = static_cast<double>(EstimateMemory(job)) / 1e6;
    EXPECT_GT(estimate, measured.peak_megabytes);
    EXPECT_LT(estimate, 1.3 * measured.peak_megabytes);
  }
}

struct MeasuredUpdate {
  int64_t vertices, points, base_bytes;
  double peak_megabytes;
};

// Of stars, every height of which changed, or a tenth of them; and of a sphere.
const MeasuredUpdate kMeasuredUpdates[] = {
    {16'386, 20'000, 1'144, 24.6},  {16'386, 2'500, 1'144, 19.3}, {262'146, 200'000, 7'250, 137.0},
    {262'146, 25'000, 7'250, 87.6}, {4'098, 600'000, 260, 242.0},
};

TEST(MemoryEstimate, OfUpdatesToo) {
  for (const MeasuredUpdate& measured : kMeasuredUpdates) {
    SCOPED_TRACE(testing::Message() << measured.points << " points");
    JobRequest job;
    job.size.points = measured.points;
    job.size.base_bytes = measured.base_bytes;
    job.base_vertices = measured.vertices;
    const auto estimate = static_cast<double>(EstimateMemory(job)) / 1e6;
    EXPECT_GT(estimate, measured.peak_megabytes);
    EXPECT_LT(estimate, 1.7 * measured.peak_megabytes);
  }
}

TEST(MemoryEstimate, NeverOfMoreFacesThanTheServerBuilds) {
  JobRequest job;
  job.size.points = 100'000;
  job.options.max_level = 8;
  job.options.control.target_faces = 12'000;
  job.options.max_surface_faces = 1'000'000;
  EXPECT_LT(EstimateMemory(job), 250'000'000);
}

}  // namespace
}  // namespace rilievo
