// Four boxes of a tree and their distances from a place, in vector instructions.
#pragma once

#include <cmath>
#include <limits>

namespace rilievo {

// A box in float: rounded outward it holds what lies in it in double. At first it is empty, and
// infinitely far from everything.
struct FloatBox {
  static constexpr float kInfinity = std::numeric_limits<float>::infinity();

  float lo[3] = {kInfinity, kInfinity, kInfinity};
  float hi[3] = {-kInfinity, -kInfinity, -kInfinity};

  void Add(const FloatBox& other) {
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = lo[axis] < other.lo[axis] ? lo[axis] : other.lo[axis];
      hi[axis] = hi[axis] > other.hi[axis] ? hi[axis] : other.hi[axis];
    }
  }

  static float RoundDown(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) > x ? std::nextafter(f, -kInfinity) : f;
  }
  static float RoundUp(double x) {
    const float f = static_cast<float>(x);
    return static_cast<double>(f) < x ? std::nextafter(f, kInfinity) : f;
  }
};

// Each instruction works on all four: of a loop over scalars g++ 12 makes branches instead.
struct FourBoxes {
  static constexpr int kBoxes = 4;
  using Lanes = float __attribute__((vector_size(kBoxes * sizeof(float))));

  Lanes lo[3], hi[3];  // by axis

  void Set(int slot, const FloatBox& box) {
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis][slot] = box.lo[axis];
      hi[axis][slot] = box.hi[axis];
    }
  }

  // Squared; 0 within a box.
  Lanes SquaredDistances(const float place[3]) const {
    constexpr Lanes kNone = {};
    Lanes distance = {};
    for (int axis = 0; axis < 3; ++axis) {
      const Lanes below = lo[axis] - place[axis], above = place[axis] - hi[axis];
      Lanes out = below > above ? below : above;
      out = out > kNone ? out : kNone;
      distance += out * out;
    }
    return distance;
  }
};

}  // namespace rilievo
