#include "core/codec/mesh/control_mesh_coder.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/mesh/gate_models.h"
#include "core/codec/mesh/mesh_border.h"
#include "core/codec/mesh/point_models.h"
#include "core/geometry/half_edges.h"

namespace rilievo {
namespace {

constexpr int kNone = -1;

// The next step of the walk as an encoder knows it and a decoder does not.
struct KnownStep {
  GateStep step = GateStep::kBoundary;
  int at = kNone;                           // element of the border, for kAcross
  int left_tag = kNone, right_tag = kNone;  // half-edges of the face across the gate
};

// Leads the walk over a mesh that is there: finds what lies across each gate.
class MeshGuide {
 public:
  explicit MeshGuide(const MeshTopology& topology)
      : topology_(topology),
        twins_(3 * topology.faces.cols(), kNone),
        boundary_out_(topology.vertex_count, kNone),
        number_(topology.vertex_count, kNone),
        element_(3 * topology.faces.cols(), kNone),
        face_done_(topology.faces.cols(), 0) {
    for (int f = 0; f < topology.face_count(); ++f) {
      for (int k = 0; k < 3; ++k) {
        const int neighbor = topology.face_neighbors(k, f), h = 3 * f + k;
        if (neighbor < 0) {
          boundary_out_[Start(h)] = h;
          continue;
        }
        int other = 0;
        while (topology.face_edges(other, neighbor) != topology.face_edges(k, f)) ++other;
        twins_[h] = 3 * neighbor + other;
      }
    }
  }

  // Corner 0 of the first face not yet coded; its vertices get the next numbers.
  int Seed() {
    while (face_done_[next_seed_] != 0) ++next_seed_;
    const int first = 3 * next_seed_;
    for (int k = 0; k < 3; ++k) Number(Start(first + k));
    FinishFace(first);
    return first;
  }

  KnownStep Across(const MeshBorder& border, int gate) {
    const int across = twins_[border[gate].tag];
    if (across == kNone) return {};
    KnownStep known;
    known.left_tag = Next(across);
    known.right_tag = Next(known.left_tag);
    const int apex = Start(known.right_tag), number = number_[apex];
    if (number == kNone) {
      known.step = GateStep::kNewVertex;
      Number(apex);
    } else if (border.CanCloseLeft(gate) && number == border[border[gate].prev].vertex) {
      known.step = GateStep::kLeft;
    } else if (border.CanCloseRight(gate) && number == border.End(border[gate].next)) {
      known.step = GateStep::kRight;
    } else {
      known.step = GateStep::kAcross;
      known.at = GapAt(known.left_tag);
    }
    FinishFace(across);
    return known;
  }

  // Notes the elements that the walk has added since the last call.
  void Follow(const MeshBorder& border) {
    for (; followed_ < border.size(); ++followed_) element_[border[followed_].tag] = followed_;
  }

  int VertexOf(int number) const { return order_.vertices[number]; }
  CodingOrder TakeOrder() { return std::move(order_); }

 private:
  int Start(int h) const { return Origin(topology_.faces, static_cast<uint32_t>(h)); }
  static int Next(int h) { return static_cast<int>(NextHalfEdge(static_cast<uint32_t>(h))); }
  static int Previous(int h) {
    return static_cast<int>(PreviousHalfEdge(static_cast<uint32_t>(h)));
  }

  void Number(int vertex) {
    number_[vertex] = static_cast<int>(order_.vertices.size());
    order_.vertices.push_back(vertex);
  }

  void FinishFace(int first_corner) {
    face_done_[first_corner / 3] = 1;
    order_.corners.push_back(first_corner);
  }

  // The element that leaves the end of half-edge `incoming` and bounds the gap its face lies in:
  // turns around the vertex, over holes too, up to the first coded face.
  int GapAt(int incoming) const {
    for (;;) {
      const int twin = twins_[incoming];
      const int outgoing = twin != kNone ? twin : boundary_out_[Start(Next(incoming))];
      if (face_done_[outgoing / 3] != 0) return element_[outgoing];
      incoming = Previous(outgoing);
    }
  }

  const MeshTopology& topology_;
  std::vector<int> twins_, boundary_out_;
  std::vector<int> number_;   // in coding order, of each vertex
  std::vector<int> element_;  // of the border, last known of each half-edge
  std::vector<uint8_t> face_done_;
  int next_seed_ = 0, followed_ = 0;
  CodingOrder order_;
};

// Knows nothing: the steps come out of the bytes.
class NoGuide {
 public:
  int Seed() { return kNone; }
  KnownStep Across(const MeshBorder&, int) { return {}; }
  void Follow(const MeshBorder&) {}
};

// The walk that encoder and decoder have in common.
template <typename Coder, typename Guide, typename Points>
class MeshWalk {
 public:
  // `points`: in coding order; empty when decoding.
  MeshWalk(Coder& coder, Guide& guide, Points& point_model, const std::vector<GridPoint>& points,
           int vertex_count, int face_count, bool has_boundary)
      : coder_(coder),
        guide_(guide),
        point_model_(point_model),
        points_(points),
        vertex_count_(vertex_count),
        face_count_(face_count),
        models_(has_boundary) {}

  absl::Status Run() {
    while (static_cast<int>(mesh_.faces.size()) < face_count_) {
      RILIEVO_RETURN_IF_ERROR(StartComponent());
      for (int gate = NextGate(); gate != kNone; gate = NextGate()) {
        if (static_cast<int>(mesh_.faces.size()) == face_count_) break;
        RILIEVO_RETURN_IF_ERROR(PassGate(gate));
        guide_.Follow(border_);
      }
    }
    if (static_cast<int>(mesh_.points.size()) != vertex_count_) {
      return absl::DataLossError(absl::StrCat("the control mesh has ", mesh_.points.size(),
                                              " vertices, its header says ", vertex_count_));
    }
    return absl::OkStatus();
  }

  CodedMesh TakeMesh() { return std::move(mesh_); }

 private:
  absl::Status StartComponent() {
    const int tag = guide_.Seed();
    const int first = static_cast<int>(mesh_.points.size());
    PointGate gate;
    gate.seed = true;
    for (int k = 0; k < 3; ++k) {
      if (!mesh_.points.empty()) gate.start = mesh_.points.back();
      RILIEVO_RETURN_IF_ERROR(AddVertex(gate));
    }
    mesh_.AddFace(first, first + 1, first + 2);
    const int tags[3] = {tag, tag + 1, tag + 2};
    border_.AddTriangle(first, first + 1, first + 2, tags);
    guide_.Follow(border_);
    return absl::OkStatus();
  }

  // The pivot: the walk turns around one vertex until its fan is closed, then goes on with the
  // oldest element that is open.
  int NextGate() {
    if (turning_ != kNone && border_.Open(turning_)) return turning_;
    for (; oldest_ < border_.size(); ++oldest_) {
      if (border_.Open(oldest_)) return oldest_;
    }
    return kNone;
  }

  absl::Status PassGate(int gate) {
    const KnownStep known = guide_.Across(border_, gate);
    const GateStep step = models_.CodeStep(coder_, known.step, border_, mesh_, gate);
    const int start = border_[gate].vertex, end = border_.End(gate);
    turning_ = kNone;
    switch (step) {
      case GateStep::kBoundary:
        border_.MarkBoundary(gate);
        return absl::OkStatus();
      case GateStep::kLeft: {
        const int left = border_[gate].prev;
        mesh_.AddFace(end, start, border_[left].vertex);
        border_.GlueLeft(gate, known.right_tag);
        return absl::OkStatus();
      }
      case GateStep::kRight: {
        const int right = border_[gate].next;
        mesh_.AddFace(end, start, border_.End(right));
        turning_ = border_.GlueRight(gate, known.left_tag);
        return absl::OkStatus();
      }
      case GateStep::kNewVertex: {
        const int apex = static_cast<int>(mesh_.points.size());
        RILIEVO_RETURN_IF_ERROR(AddVertex(
            {false, mesh_.points[start], mesh_.points[end], mesh_.points[border_[gate].apex]}));
        mesh_.AddFace(end, start, apex);
        turning_ = border_.GlueNewVertex(gate, apex, known.left_tag, known.right_tag);
        return absl::OkStatus();
      }
      case GateStep::kAcross:
        break;
    }
    const int index =
        models_.CodeIndex(coder_, known.at == kNone ? 0 : border_[known.at].live_index,
                          static_cast<int>(border_.live().size()));
    const int at = border_.live()[index], apex = border_[at].vertex;
    if (apex == start || apex == end) {
      return absl::DataLossError("a face of the control mesh names a vertex twice");
    }
    mesh_.AddFace(end, start, apex);
    turning_ = border_.GlueAcross(gate, at, known.left_tag, known.right_tag);
    return absl::OkStatus();
  }

  absl::Status AddVertex(const PointGate& gate) {
    const size_t number = mesh_.points.size();
    if (static_cast<int>(number) == vertex_count_) {
      return absl::DataLossError(
          absl::StrCat("the control mesh has more vertices than its header says, ", vertex_count_));
    }
    const GridPoint known = coder_.kDecodes ? GridPoint{} : points_[number];
    const GridPoint point = point_model_.Code(coder_, known, gate);
    for (int32_t coordinate : point) {
      if (coordinate < -kMaxCoordinate || coordinate > kMaxCoordinate) {
        return absl::DataLossError("a control point lies outside the range of the format");
      }
    }
    mesh_.AddVertex(point);
    return absl::OkStatus();
  }

  Coder& coder_;
  Guide& guide_;
  Points& point_model_;
  const std::vector<GridPoint>& points_;
  int vertex_count_, face_count_;
  GateModels models_;
  MeshBorder border_;
  CodedMesh mesh_;
  int turning_ = kNone, oldest_ = 0;
};

// Takes the bits and keeps none.
struct BitSink {
  static constexpr bool kDecodes = false;
  bool Code(bool bit, uint32_t /*one_probability*/) { return bit; }
};

// For the order alone.
struct NoPoints {
  template <typename Coder>
  GridPoint Code(Coder&, const GridPoint& point, const PointGate&) {
    return point;
  }
};

bool HasBoundary(const MeshTopology& topology) {
  return topology.face_neighbors.cols() > 0 && topology.face_neighbors.minCoeff() < 0;
}

template <typename Points>
absl::StatusOr<GridMesh> Decode(std::span<const uint8_t> bytes, Points& point_model,
                                int vertex_count, int face_count, bool has_boundary) {
  NoGuide guide;
  RangeDecoder coder(bytes);
  const std::vector<GridPoint> none;
  MeshWalk walk(coder, guide, point_model, none, vertex_count, face_count, has_boundary);
  RILIEVO_RETURN_IF_ERROR(walk.Run());
  if (coder.overrun()) return absl::DataLossError("the control mesh ends before its last face");
  CodedMesh coded = walk.TakeMesh();
  GridMesh mesh;
  mesh.points = std::move(coded.points);
  mesh.faces.resize(3, static_cast<Eigen::Index>(coded.faces.size()));
  for (size_t f = 0; f < coded.faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) mesh.faces(k, static_cast<Eigen::Index>(f)) = coded.faces[f][k];
  }
  return mesh;
}

}  // namespace

CodingOrder FindCodingOrder(const MeshTopology& topology) {
  MeshGuide guide(topology);
  BitSink sink;
  const std::vector<GridPoint> nowhere(topology.vertex_count, GridPoint{0, 0, 0});
  NoPoints points;
  MeshWalk walk(sink, guide, points, nowhere, topology.vertex_count, topology.face_count(),
                HasBoundary(topology));
  return walk.Run().ok() ? guide.TakeOrder() : CodingOrder();
}

int SeedBits(double step) {
  const double steps = std::clamp(0.5 / step, 1.0, static_cast<double>(1 << 27));
  return std::bit_width(static_cast<uint32_t>(steps));
}

absl::StatusOr<std::vector<uint8_t>> EncodeControlMesh(const MeshTopology& topology,
                                                       const std::vector<GridPoint>& points,
                                                       int seed_bits) {
  MeshGuide guide(topology);
  RangeEncoder coder;
  PointModel point_model(seed_bits);
  MeshWalk walk(coder, guide, point_model, points, topology.vertex_count, topology.face_count(),
                HasBoundary(topology));
  RILIEVO_RETURN_IF_ERROR(walk.Run());
  const CodingOrder order = guide.TakeOrder();
  for (size_t i = 0; i < order.vertices.size(); ++i) {
    if (order.vertices[i] != static_cast<int>(i)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "vertex ", i, " of the control mesh is not in coding order: call PrepareControlMesh"));
    }
  }
  for (size_t f = 0; f < order.corners.size(); ++f) {
    if (order.corners[f] != static_cast<int>(3 * f)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "face ", f, " of the control mesh is not in coding order: call PrepareControlMesh"));
    }
  }
  return coder.Finish();
}

absl::StatusOr<GridMesh> DecodeControlMesh(std::span<const uint8_t> bytes, int vertex_count,
                                           int face_count, bool has_boundary, int seed_bits) {
  PointModel points(seed_bits);
  return Decode(bytes, points, vertex_count, face_count, has_boundary);
}

absl::StatusOr<GridMesh> DecodeControlMeshV1(std::span<const uint8_t> bytes, int vertex_count,
                                             int face_count, bool has_boundary) {
  PointModelV1 points;
  return Decode(bytes, points, vertex_count, face_count, has_boundary);
}

}  // namespace rilievo
