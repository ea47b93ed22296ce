#include "core/pipeline/page_runs.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "core/pipeline/settings.h"

namespace rilievo {

bool IsWorthHalving(int64_t points, int64_t points_of_larger_half) {
  return static_cast<double>(points_of_larger_half) <
         kPageRuns.larger_half * static_cast<double>(points);
}

int64_t PointsOfRun(const PageRun& run, int64_t size) {
  return std::min(size, int64_t{run.end} * kPagePoints) - int64_t{run.begin} * kPagePoints;
}

PageRuns::PageRuns(const PagedScan& scan, double halo) : scan_(scan) {
  first_ = {0};
  for (const Page& page : scan.pages()) first_.push_back(first_.back() + page.stretches.size());
  tree_.reserve(2 * first_.back());
  tree_.resize(first_.back());
  for (const Page& page : scan.pages()) {
    for (const PageStretch& stretch : page.stretches) {
      tree_.emplace_back(stretch.box.min().array() - halo, stretch.box.max().array() + halo);
    }
  }
  for (size_t node = first_.back(); node-- > 1;) {
    tree_[node] = tree_[2 * node].merged(tree_[2 * node + 1]);
  }
}

std::vector<PageRun> PageRuns::Cut(int64_t most_points) const {
  std::vector<PageRun> runs;
  const int pages = static_cast<int>(scan_.pages().size());
  if (pages > 0) Split(RunOf(0, pages), most_points, &runs);
  return runs;
}

bool PageRuns::IsAround(const PageRun& run, const Eigen::Vector3d& point) const {
  return IsAround(run.begin, run.end, Box(point));
}

// The nodes that together hold a range of leaves, as of a segment tree.
bool PageRuns::IsAround(int begin, int end, const Box& box) const {
  size_t low = first_[begin] + first_.back(), high = first_[end] + first_.back();
  for (; low < high; low /= 2, high /= 2) {
    if (low % 2 == 1 && Touches(low++, box)) return true;
    if (high % 2 == 1 && Touches(--high, box)) return true;
  }
  return false;
}

bool PageRuns::Touches(size_t node, const Box& box) const {
  if (!tree_[node].intersects(box)) return false;
  return node >= first_.back() || Touches(2 * node, box) || Touches(2 * node + 1, box);
}

PageRun PageRuns::RunOf(int begin, int end) const {
  PageRun run{begin, end, {}, 0};
  for (int number = 0; number < static_cast<int>(scan_.pages().size()); ++number) {
    const Page& page = scan_.pages()[number];
    const bool is_own = number >= begin && number < end;
    if (!is_own && !IsAround(begin, end, page.box)) continue;
    const int64_t before = run.points;
    for (const PageStretch& stretch : page.stretches) {
      if (is_own || IsAround(begin, end, stretch.box)) run.points += stretch.points;
    }
    if (run.points > before) run.read.push_back(number);
  }
  return run;
}

void PageRuns::Split(PageRun run, int64_t most_points, std::vector<PageRun>* runs) const {
  if (run.end - run.begin > 1 && run.points > most_points) {
    const int middle = run.begin + (run.end - run.begin) / 2;
    PageRun first = RunOf(run.begin, middle), second = RunOf(middle, run.end);
    if (IsWorthHalving(run.points, std::max(first.points, second.points))) {
      Split(std::move(first), most_points, runs);
      Split(std::move(second), most_points, runs);
      return;
    }
  }
  runs->push_back(std::move(run));
}

}  // namespace rilievo
