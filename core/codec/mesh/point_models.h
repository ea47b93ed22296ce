// Where the next control point stands: predicted by a parallelogram, corrected by residuals.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>

#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/residual_model.h"
#include "core/codec/mesh/gate_geometry.h"

namespace rilievo {

// What a new control point is predicted from: the gate's face start -> end -> apex, across whose
// side start, end it lies; for the first three of a component the point before (in `start`) alone.
struct PointGate {
  bool seed = false;
  GridPoint start = {0, 0, 0}, end = {0, 0, 0}, apex = {0, 0, 0};
  GridPoint Predicted() const { return seed ? start : Parallelogram(start, end, apex); }
};

// Format version 1: axis after axis, each with the bits of its scale as context.
class PointModelV1 {
 public:
  template <typename Coder>
  GridPoint Code(Coder& coder, const GridPoint& point, const PointGate& gate) {
    const GridPoint predicted = gate.Predicted();
    const int scale_bits = gate.seed ? kSeedScale : EdgeBits(gate.start, gate.end);
    GridPoint coded;
    int previous_bits = 0, first_bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t residual =
          residuals_.Code(coder, coder.kDecodes ? 0 : point[axis] - predicted[axis],
                          {axis * 32 + scale_bits, axis * 32 + previous_bits, first_bits});
      coded[axis] = predicted[axis] + residual;
      const int bits = std::bit_width(static_cast<uint32_t>(std::abs(residual)));
      if (axis == 0) first_bits = bits;
      previous_bits = std::max(bits, previous_bits);
    }
    return coded;
  }

 private:
  static constexpr int kSeedScale = 31;
  ResidualModel<3> residuals_{{96, 96, 32}, 255};
};

// Version 2. Two axes first, then the one along which the gate's face looks most: given the other
// two, the plane of that face predicts it, and it is off by the bend of the surface only. Lengths
// are coded relative to the gate's edge, so that meshes of all sizes share what is learned.
class PointModel {
 public:
  explicit PointModel(int seed_bits) : seed_bits_(seed_bits) {}

  template <typename Coder>
  GridPoint Code(Coder& coder, const GridPoint& point, const PointGate& gate) {
    const GridPoint predicted = gate.Predicted();
    const int scale = gate.seed ? seed_bits_ : EdgeBits(gate.start, gate.end);
    const std::array<int64_t, 3> normal =
        gate.seed ? std::array<int64_t, 3>{0, 0, 0} : GateNormal(gate.start, gate.end, gate.apex);
    int last = 2;
    for (int axis = 1; axis >= 0; --axis) {
      if (std::abs(normal[axis]) > std::abs(normal[last])) last = axis;
    }
    const std::array<int, 3> axes = {(last + 1) % 3, (last + 2) % 3, last};
    GridPoint coded = predicted;
    std::array<int64_t, 3> offset = {0, 0, 0};
    int longest = 0;
    for (int turn = 0; turn < 3; ++turn) {
      const int axis = axes[turn];
      int64_t expected = predicted[axis];
      if (turn == 2 && normal[last] != 0) {
        expected -=
            (normal[axes[0]] * offset[axes[0]] + normal[axes[1]] * offset[axes[1]]) / normal[last];
      }
      const bool outward = normal[last] > 0;  // residuals along the normal count from inside
      const int kind = gate.seed ? 3 : turn;
      const int64_t given = coder.kDecodes ? 0 : point[axis] - expected;
      const int64_t residual =
          CodeLength(coder, kind == 2 && !outward ? -given : given, kind, scale, longest);
      longest = std::max(longest, last_length_);
      const int64_t coordinate = expected + (kind == 2 && !outward ? -residual : residual);
      coded[axis] = static_cast<int32_t>(
          std::clamp<int64_t>(coordinate, -kMaxCoordinate - 1, kMaxCoordinate + 1));
      offset[axis] = int64_t{coded[axis]} - predicted[axis];
    }
    return coded;
  }

 private:
  static constexpr int kFineBits = 5;  // lengths below 1/32 of the scale are not told apart
  static constexpr int kKinds = 4, kLengths = 32, kContexts = kKinds * 8;

  // |residual| < 2^base is length 0, then every further binary digit is a length more.
  template <typename Coder>
  int64_t CodeLength(Coder& coder, int64_t residual, int kind, int scale, int longest) {
    const int base = std::max(0, scale - kFineBits);
    const uint64_t given = static_cast<uint64_t>(std::abs(residual));
    const int given_length = std::max(0, static_cast<int>(std::bit_width(given)) - base);
    const std::array<int, 3> contexts = {kind * 8 + std::min(7, longest),
                                         kind * 8 + std::min(7, lengths_[kind]),
                                         kind * 8 + std::min(7, std::min(kFineBits, scale))};
    int length = 0;
    while (length + base < 30 && Ask(coder, given_length > length, length, contexts)) ++length;
    uint64_t magnitude = length > 0 ? 1 : 0;
    for (int at = base + std::max(0, length - 1) - 1, first = 1; at >= 0; --at, first = 0) {
      const bool bit = ((given >> at) & 1) != 0;
      const bool coded = length > 0 && first != 0 ? Ask(coder, bit, kLengths + length, contexts)
                                                  : coder.Code(bit, 32768);
      magnitude = 2 * magnitude + (coded ? 1 : 0);
    }
    last_length_ = lengths_[kind] = length;
    if (magnitude == 0) return 0;
    const bool negative = Ask(coder, residual < 0, 2 * kLengths,
                              {kind * 8 + std::min(7, length), kind * 8 + signs_[kind], kind * 8});
    signs_[kind] = (signs_[kind] * 2 + (negative ? 1 : 0)) % 4;
    return negative ? -static_cast<int64_t>(magnitude) : static_cast<int64_t>(magnitude);
  }

  template <typename Coder>
  bool Ask(Coder& coder, bool answer, int node, const std::array<int, 3>& contexts) {
    std::array<BitModel*, 3> inputs;
    for (int i = 0; i < 3; ++i) inputs[i] = &models_[i][contexts[i]][node];
    return mixers_[node].Code(coder, answer, inputs, 255);
  }

  int seed_bits_;
  int last_length_ = 0;
  std::array<int, kKinds> lengths_{}, signs_{};
  std::array<std::array<std::array<BitModel, 2 * kLengths + 1>, kContexts>, 3> models_;
  std::array<BitMixer<3>, 2 * kLengths + 1> mixers_;
};

}  // namespace rilievo
