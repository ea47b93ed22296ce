// The tangent discs of points on the grid of an implicit function, and what is spread over them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/control/implicit/poisson_solver.h"
#include "core/control/implicit/trilinear_stencil.h"

namespace rilievo {

// Of some samples at a time: the nodes under their discs are found once, on all threads, for all
// parts that are spread. Keeps the system by reference.
class SampleSplats {
 public:
  explicit SampleSplats(const ScreenedPoisson& system) : system_(system) {}

  // How far from its point a disc reaches, in cells, for a spacing in cells.
  static double Reach(double spacing);

  // Takes the `count` samples from `begin` on. CANCELLED when stopped.
  absl::Status Take(size_t begin, size_t count, const RunContext& context);

  // Adds what they spread to `field`, by node. part 0, 1, 2: one component of the normals, weighted
  // by area, on the edges that run along that axis, each kept with the node it starts from. part 3:
  // the area itself, on the nodes. Parts may be added side by side.
  void Add(int part, std::vector<float>* field) const;

 private:
  // Some consecutive samples.
  struct Group {
    std::vector<int> sizes;                // of each disc
    std::vector<Eigen::Vector3d> offsets;  // in cells, disc after disc
    std::vector<NodesAround> around;       // of each offset
  };

  void Find(size_t begin, size_t end, SparseGridReader* grid, Group* group) const;
  void AddGroup(const Group& group, size_t begin, int part, std::vector<float>* field) const;

  const ScreenedPoisson& system_;
  size_t begin_ = 0;
  size_t group_count_ = 0;
  std::vector<Group> groups_;
};

}  // namespace rilievo
