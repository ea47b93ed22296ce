// The probabilities of what lies across a gate of the control mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "core/codec/bytes/bit_models.h"
#include "core/codec/mesh/gate_geometry.h"
#include "core/codec/mesh/mesh_border.h"

namespace rilievo {

// What lies across a gate, in the order in which the possibilities are asked for.
enum class GateStep { kBoundary, kLeft, kRight, kNewVertex, kAcross };

// What is known of the coded part around each vertex.
struct CodedMesh {
  std::vector<GridPoint> points;
  std::vector<int> angle_sums;  // of the coded faces at the vertex, 2048 = half a turn
  std::vector<int> face_counts;
  std::vector<std::array<int, 3>> faces;

  void AddVertex(const GridPoint& point) {
    points.push_back(point);
    angle_sums.push_back(0);
    face_counts.push_back(0);
  }

  void AddFace(int a, int b, int c) {
    faces.push_back({a, b, c});
    for (int k = 0; k < 3; ++k) {
      const int at = faces.back()[k], p = faces.back()[(k + 1) % 3], q = faces.back()[(k + 2) % 3];
      angle_sums[at] += CornerAngle(points[at], points[p], points[q]);
      ++face_counts[at];
    }
  }
};

class GateModels {
 public:
  explicit GateModels(bool has_boundary) : has_boundary_(has_boundary) {
    for (auto& inputs : models_) {
      for (auto& input : inputs) input.resize(kContexts);
    }
  }

  template <typename Coder>
  GateStep CodeStep(Coder& coder, GateStep step, const MeshBorder& border, const CodedMesh& mesh,
                    int gate) {
    const Around left = Look(border, mesh, gate, border[gate].vertex, border[gate].prev, false);
    const Around right = Look(border, mesh, gate, border.End(gate), border[gate].next, true);
    const int loop = LoopClass(border, gate);
    if (has_boundary_ &&
        CodeBit(coder, step == GateStep::kBoundary, GateStep::kBoundary,
                {loop * 4 + left.closed * 2 + right.closed, left.gap * 8 + right.gap / 3,
                 left.faces * 10 + right.faces, left.closed * 12 + left.distance})) {
      return GateStep::kBoundary;
    }
    if (border.CanCloseLeft(gate) &&
        CodeBit(coder, step == GateStep::kLeft, GateStep::kLeft,
                {left.gap * 3 + loop, left.distance * 12 + right.distance,
                 left.faces * 10 + right.faces, left.gap / 2 * 16 + left.corner})) {
      return GateStep::kLeft;
    }
    if (border.CanCloseRight(gate) &&
        CodeBit(coder, step == GateStep::kRight, GateStep::kRight,
                {right.gap * 3 + loop, right.distance * 12 + left.distance,
                 right.faces * 10 + left.faces, right.gap / 2 * 16 + right.corner})) {
      return GateStep::kRight;
    }
    if (CodeBit(coder, step == GateStep::kNewVertex, GateStep::kNewVertex,
                {loop, left.gap, right.gap, left.distance * 12 + right.distance})) {
      return GateStep::kNewVertex;
    }
    return GateStep::kAcross;
  }

  // Which of the live elements of the border.
  template <typename Coder>
  int CodeIndex(Coder& coder, int index, int count) {
    int low = 0;  // the index lies in [low, low + count)
    while (count > 1) {
      const int half = count / 2;
      const uint32_t upper =
          static_cast<uint32_t>((static_cast<int64_t>(count - half) << 16) / count);
      const bool high = coder.Code(index >= low + half, std::clamp(upper, 1u, 65535u));
      if (high) low += half;
      count = high ? count - half : half;
    }
    return low;
  }

 private:
  static constexpr int kContexts = 256, kInputs = 4, kLimit = 255;

  // One end of the gate.
  struct Around {
    int closed;    // 1: the border goes on with a boundary edge
    int gap;       // angle left of a full turn, in 1/24 of it, [0, 24]
    int corner;    // angle between the gate and the border's next edge, in 1/32 of a turn, [0, 15]
    int distance;  // of that edge's other end from the parallelogram's corner, [0, 11]
    int faces;     // coded ones at the vertex, at most 9
  };

  static Around Look(const MeshBorder& border, const CodedMesh& mesh, int gate, int vertex,
                     int neighbor, bool right) {
    const GridPoint& start = mesh.points[border[gate].vertex];
    const GridPoint& end = mesh.points[border.End(gate)];
    const int other = right ? border.End(neighbor) : border[neighbor].vertex;
    const GridPoint corner = Parallelogram(start, end, mesh.points[border[gate].apex]);
    Around around;
    around.closed = border[neighbor].is_boundary ? 1 : 0;
    around.gap = std::clamp((4096 - mesh.angle_sums[vertex]) / 171, 0, 24);
    around.corner = std::min(
        15, CornerAngle(mesh.points[vertex], right ? start : end, mesh.points[other]) / 128);
    around.distance = RelativeDistance(corner, mesh.points[other], start, end);
    around.faces = std::min(9, mesh.face_counts[vertex]);
    return around;
  }

  // 2: the border's loop has three edges left, 1: four, 0: another number.
  static int LoopClass(const MeshBorder& border, int gate) {
    const int second = border[border[gate].next].next;
    if (second == border[gate].prev) return 2;
    return border[second].next == border[gate].prev ? 1 : 0;
  }

  template <typename Coder>
  bool CodeBit(Coder& coder, bool bit, GateStep asked, const std::array<int, kInputs>& contexts) {
    const int kind = static_cast<int>(asked);
    std::array<BitModel*, kInputs> inputs;
    for (int i = 0; i < kInputs; ++i) inputs[i] = &models_[kind][i][contexts[i]];
    return mixers_[kind].Code(coder, bit, inputs, kLimit);
  }

  bool has_boundary_;
  std::array<std::array<std::vector<BitModel>, kInputs>, 4> models_;
  std::array<BitMixer<kInputs>, 4> mixers_;
};

}  // namespace rilievo
