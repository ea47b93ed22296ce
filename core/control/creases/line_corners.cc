#include "core/control/creases/line_corners.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// A line by the length along it; a closed one goes round.
class Line {
 public:
  Line(const Eigen::Matrix3Xd& vertices, const CreaseChain& chain)
      : vertices_(vertices), chain_(chain) {
    ends_.push_back(0);
    for (int i = 0; i < static_cast<int>(chain.edges.size()); ++i) {
      ends_.push_back(ends_.back() + (At(i + 1) - At(i)).norm());
    }
  }

  int size() const { return static_cast<int>(chain_.vertices.size()); }
  double length() const { return ends_.back(); }
  double PlaceOf(int i) const { return ends_[i]; }

  double TurnAt(int i, double reach) const {
    const Vector3d in = At(i) - Along(ends_[i] - reach), out = Along(ends_[i] + reach) - At(i);
    return std::atan2(in.cross(out).norm(), in.dot(out));
  }

 private:
  Vector3d At(int i) const { return vertices_.col(chain_.vertices[i % size()]); }

  Vector3d Along(double place) const {
    if (chain_.closed) place -= length() * std::floor(place / length());
    const auto after = std::upper_bound(ends_.begin() + 1, ends_.end() - 1, place);
    const auto i = static_cast<int>(after - ends_.begin()) - 1;
    const double edge = ends_[i + 1] - ends_[i];
    const double part = edge > 0 ? std::clamp((place - ends_[i]) / edge, 0.0, 1.0) : 0;
    return At(i) + part * (At(i + 1) - At(i));
  }

  const Eigen::Matrix3Xd& vertices_;
  const CreaseChain& chain_;
  std::vector<double> ends_;  // of the edges, along the line, after a 0
};

struct Turn {
  int vertex;  // of the line
  double place, angle;
};

// Without those that have another one, at least as large, nearer than `reach` before them. `turns`:
// by place, forwards or backwards.
std::vector<Turn> WithoutLesser(const std::vector<Turn>& turns, double reach) {
  std::vector<Turn> left;
  std::vector<Turn>
      larger;  // the nearest one before, the nearest still larger one before that, ...
  for (const Turn& turn : turns) {
    while (!larger.empty() && larger.back().angle < turn.angle) larger.pop_back();
    if (larger.empty() || std::abs(turn.place - larger.back().place) >= reach) left.push_back(turn);
    larger.push_back(turn);
  }
  return left;
}

}  // namespace

std::vector<int> CornersOfLine(const Eigen::Matrix3Xd& vertices, const CreaseChain& chain,
                               double angle, double reach) {
  const Line line(vertices, chain);
  std::vector<Turn> turns;
  for (int i = chain.closed ? 0 : 1; i < (chain.closed ? line.size() : line.size() - 1); ++i) {
    const Turn turn{i, line.PlaceOf(i), line.TurnAt(i, reach)};
    if (turn.angle > angle) turns.push_back(turn);
  }
  if (turns.empty()) return {};
  if (chain.closed) {  // from the largest turn round to it
    const auto smaller = [](const Turn& p, const Turn& q) { return p.angle < q.angle; };
    const auto largest = std::max_element(turns.begin(), turns.end(), smaller);
    for (auto turn = turns.begin(); turn != largest; ++turn) turn->place += line.length();
    std::rotate(turns.begin(), largest, turns.end());
    turns.push_back(turns.front());
    turns.back().place += line.length();
  }
  turns = WithoutLesser(turns, reach);
  std::reverse(turns.begin(), turns.end());
  turns = WithoutLesser(turns, reach);
  std::vector<int> corners;
  for (const Turn& turn : turns) corners.push_back(chain.vertices[turn.vertex]);
  return corners;
}

}  // namespace rilievo
