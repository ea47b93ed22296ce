#include "core/control/implicit/splat_samples.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/base/parallel_for.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

constexpr int kSamplesPerTask = 256;

}  // namespace

double SampleSplats::Reach(double spacing) { return kCommon.disc_spacings * spacing; }

absl::Status SampleSplats::Take(size_t begin, size_t count, const RunContext& context) {
  begin_ = begin;
  group_count_ = (count + kSamplesPerTask - 1) / kSamplesPerTask;
  groups_.resize(std::max(groups_.size(), group_count_));
  return ParallelFor(
      static_cast<int64_t>(group_count_), 1, context, [&](int64_t first, int64_t last) {
        SparseGridReader grid(system_.grid);
        for (int64_t g = first; g < last; ++g) {
          const size_t from = begin + kSamplesPerTask * g;
          Find(from, std::min(from + kSamplesPerTask, begin + count), &grid, &groups_[g]);
        }
      });
}

void SampleSplats::Add(int part, std::vector<float>* field) const {
  for (size_t g = 0; g < group_count_; ++g) {
    AddGroup(groups_[g], begin_ + kSamplesPerTask * g, part, field);
  }
}

void SampleSplats::Find(size_t begin, size_t end, SparseGridReader* grid, Group* group) const {
  group->sizes.clear();
  group->offsets.clear();
  group->around.clear();
  std::vector<Eigen::Vector3d> disc;
  NodesAround around;
  for (size_t sample = begin; sample < end; ++sample) {
    const int point = system_.samples.points[sample];
    TangentDisc(system_.cloud.normals.col(point), Reach(system_.SpacingInCells(sample)), &disc);
    group->sizes.push_back(static_cast<int>(disc.size()));
    const Eigen::Vector3d at = system_.LatticePoint(sample);
    for (const Eigen::Vector3d& offset : disc) {
      group->offsets.push_back(offset);
      around.MoveTo(at + offset, grid);
      group->around.push_back(around);
    }
  }
}

void SampleSplats::AddGroup(const Group& group, size_t begin, int part,
                            std::vector<float>* field) const {
  std::array<int, 8> nodes;
  size_t entry = 0;
  for (size_t m = 0; m < group.sizes.size(); ++m) {
    const int i = system_.samples.points[begin + m];
    Eigen::Vector3d at = system_.LatticePoint(begin + m);
    if (part < 3) at[part] -= 0.5;
    const double spacing = system_.SpacingInCells(begin + m);
    const double area = std::numbers::pi / 4 * spacing * spacing;  // in cell units
    const double share = part < 3 ? system_.sides[i] * system_.cloud.normals(part, i) : 1.0;
    const auto amount = static_cast<float>(area * share / group.sizes[m]);
    for (const size_t end = entry + group.sizes[m]; entry < end; ++entry) {
      const Trilinear weights(at + group.offsets[entry]);
      const NodesAround& around = group.around[entry];
      // Rounding may take a place between two cells to one that its nodes do not reach.
      if (around.Holds(weights.base)) {
        nodes = around.Cell(weights.base);
      } else {
        system_.grid.FindCell(weights.base, &nodes);
      }
      for (int corner = 0; corner < 8; ++corner) {
        if (nodes[corner] >= 0) (*field)[nodes[corner]] += weights.weight[corner] * amount;
      }
    }
  }
}

}  // namespace rilievo
