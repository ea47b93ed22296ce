// The coefficients of one level of heights as adaptive bits (docs/dss-format.md, version 3).
//
// Encoder and decoder share LevelCoder: it walks the level's new vertices in blocks of faces, skips
// blocks without coefficients, and predicts every bit from the coarser levels, from neighbours
// already coded and from the shape of the heights so far. What is to be coded comes from a
// `Chooser`, which an encoder makes from its targets; a decoder's knows nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/codec/bytes/bit_models.h"
#include "core/codec/bytes/magnitude_class.h"
#include "core/codec/bytes/residual_model.h"
#include "core/codec/heights/edge_rules.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Largest |coefficient|, in steps.
inline constexpr int32_t kMaxCoefficient = 1 << 24;

// What the levels done so far leave for the next one. Entries by vertex.
struct HeightState {
  std::vector<int32_t> heights;       // of the level before, in units
  std::vector<int32_t> coefficients;  // of all levels, in steps of theirs
  std::vector<uint8_t> filled;
  // (j)(f): whether the last level had coefficients within face f of level j.
  std::vector<std::vector<uint8_t>> active;
};

// All probabilities; they live on from level to level.
class HeightModels {
 public:
  static constexpr int kInputs = 4, kLimit = 255, kFlagLimit = 255;
  using Coefficients = ResidualModel<kInputs>;
  static constexpr Coefficients::Contexts kSizes = {16 * 6 + 1, 16 * 16, 16 * 8 + 1, 16 * 4 + 1};

  Coefficients control{{16 * 3, 1, 1, 1}, kLimit};
  Coefficients edges{kSizes, kLimit};

  // One yes-or-no question with two contexts.
  template <typename Coder>
  bool Ask(Coder& coder, bool answer, int question, int first, int second) {
    const std::array<BitModel*, 2> inputs = {&flags_[question][0][first],
                                             &flags_[question][1][second]};
    return flag_mixers_[question].Code(coder, answer, inputs, kFlagLimit);
  }
  // Contexts of a sign, three of them.
  using SignContexts = std::array<int, 3>;
  template <typename Coder>
  bool AskSign(Coder& coder, bool negative, const SignContexts& contexts) {
    const std::array<BitModel*, 3> inputs = {&signs_[0][contexts[0]], &signs_[1][contexts[1]],
                                             &signs_[2][contexts[2]]};
    return sign_mixer_.Code(coder, negative, inputs, kLimit);
  }

  enum Question { kActive, kUniform, kUniformState, kFilled, kControlFilled, kQuestions };

 private:
  static constexpr int kFlagContexts = 64;
  std::array<std::array<BitModel, kFlagContexts>, 3> signs_;
  BitMixer<3> sign_mixer_;
  std::array<std::array<std::array<BitModel, kFlagContexts>, 2>, kQuestions> flags_;
  std::array<BitMixer<2>, kQuestions> flag_mixers_;
};

template <typename Coder, typename Chooser>
class LevelCoder {
 public:
  // `level`: 0, or the one whose vertices stand on the edges of refinement.levels[level - 1].
  // `step` in units. The state holds what levels below `level` have left. `foreign`: by vertex, 1
  // where it is coded elsewhere: its coefficient counts as 0, its height as not filled; null: none.
  LevelCoder(Coder& coder, Chooser& chooser, const LoopRefinement& refinement, int level,
             int32_t step, bool has_filled, HeightModels& models, HeightState& state,
             const uint8_t* foreign = nullptr)
      : coder_(coder),
        chooser_(chooser),
        refinement_(refinement),
        topology_(refinement.levels[std::max(0, level - 1)]),
        level_(level),
        step_(step),
        has_filled_(has_filled),
        models_(models),
        state_(state),
        foreign_(foreign) {}

  // `empty`: only the flags of filled heights are coded, all coefficients are zero. False when a
  // coefficient lies outside the range of the format.
  bool Run(bool empty) {
    if (level_ == 0) return CodeControlVertices(empty);
    const int count = topology_.vertex_count + topology_.edge_count();
    Reach(count);
    CountEdges();
    const int roots = refinement_.levels[0].face_count();
    if (has_filled_) {
      for (int f = 0; f < roots; ++f) CodeFilled(0, f);
    }
    active_.resize(std::max(1, level_ - 1));
    for (int j = 0; j < static_cast<int>(active_.size()); ++j) {
      active_[j].assign(refinement_.levels[j].face_count(), 0);
    }
    for (int f = 0; f < roots && !empty; ++f) CodeBlock(0, f, false);
    state_.active = std::move(active_);
    return in_range_;
  }

 private:
  using Contexts = HeightModels::Coefficients::Contexts;

  // Faces of the level before are gathered in leaves of 4 (level 1: of 1); an edge belongs to the
  // face that met it first, so that those of a leaf, and of every block of leaves, follow each
  // other.
  int leaf_level() const { return std::max(0, level_ - 2); }
  int LeafBegin(int j, int f) const { return f << 2 * (leaf_level() - j); }

  void CountEdges() {
    const int leaf_shift = 2 * (level_ - 1 - leaf_level());
    leaf_edges_.assign((topology_.face_count() >> leaf_shift) + 1, 0);
    for (int e = 0; e < topology_.edge_count(); ++e) {
      ++leaf_edges_[(topology_.edge_faces(0, e) >> leaf_shift) + 1];
    }
    for (size_t i = 1; i < leaf_edges_.size(); ++i) leaf_edges_[i] += leaf_edges_[i - 1];
  }
  int EdgeBegin(int j, int f) const { return leaf_edges_[LeafBegin(j, f)]; }
  int EdgeEnd(int j, int f) const { return leaf_edges_[LeafBegin(j, f + 1)]; }

  bool Own(int vertex) const { return foreign_ == nullptr || foreign_[vertex] == 0; }
  bool HasOwn(int begin, int end) const {
    while (begin < end && !Own(topology_.vertex_count + begin)) ++begin;
    return begin < end;
  }

  // An encoder's state may be longer from the start.
  void Reach(int count) {
    if (static_cast<int>(state_.coefficients.size()) < count) state_.coefficients.resize(count, 0);
    if (static_cast<int>(state_.filled.size()) < count) state_.filled.resize(count, 0);
  }

  // ---- level 0
  bool CodeControlVertices(bool empty) {
    const VertexRings rings = BuildVertexRings(topology_);
    const int count = topology_.vertex_count;
    Reach(count);
    for (int v = 0; v < count; ++v) {
      int64_t magnitudes = 0, sum = 0;
      int known = 0, filled = 0;
      for (int i = rings.neighbor_begin[v]; i < rings.neighbor_begin[v + 1]; ++i) {
        const int u = rings.neighbors[i];
        if (u >= v) continue;
        ++known;
        filled += state_.filled[u];
        sum += state_.coefficients[u];
        magnitudes += std::abs(state_.coefficients[u]);
      }
      if (has_filled_) {
        state_.filled[v] = models_.Ask(coder_, state_.filled[v] != 0, HeightModels::kControlFilled,
                                       std::min(filled, 7) * 8 + std::min(known, 7), 0);
      }
      if (empty) continue;
      const int near = known > 0 ? MagnitudeClass(4 * magnitudes / known, 15) : 15;
      const int lean = sum > 0 ? 2 : sum < 0 ? 0 : 1;
      Put(v, models_.control, {near * 3 + lean, 0, 0, 0}, {63, 63, 63 - 3 + lean});
    }
    return in_range_;
  }

  // ---- which vertices are filled
  void CodeFilled(int j, int f) {
    const MeshTopology& faces = refinement_.levels[j];
    if (!HasOwn(EdgeBegin(j, f), EdgeEnd(j, f))) return;
    const int begin = topology_.vertex_count + EdgeBegin(j, f);
    const int end = topology_.vertex_count + EdgeEnd(j, f);
    int corners = 0;
    for (int k = 0; k < 3; ++k) corners += state_.filled[faces.faces(k, f)];
    const int depth = std::min(3, leaf_level() - j);
    bool uniform = false, first = false;
    if (!Coder::kDecodes) {
      int own = 0, filled_count = 0;
      for (int v = begin; v < end; ++v) {
        own += Own(v);
        filled_count += Own(v) && state_.filled[v] != 0;
      }
      first = filled_count > 0;
      uniform = filled_count == 0 || filled_count == own;
    }
    uniform = models_.Ask(coder_, uniform, HeightModels::kUniform, depth * 4 + corners, corners);
    if (uniform) {
      const bool filled = models_.Ask(coder_, first, HeightModels::kUniformState, corners, 0);
      for (int v = begin; v < end; ++v) {
        if (Own(v)) state_.filled[v] = filled ? 1 : 0;
      }
      return;
    }
    if (j < leaf_level()) {
      for (int k = 0; k < 4; ++k) CodeFilled(j + 1, 4 * f + k);
      return;
    }
    for (int v = begin; v < end; ++v) {
      if (Own(v)) CodeFilledVertex(v);
    }
  }

  void CodeFilledVertex(int v) {
    const int edge = v - topology_.vertex_count;
    const EdgeStencil stencil = StencilOfEdge(topology_, edge);
    int ends = 0, opposite = 0, siblings = 0, known = 0;
    for (int u : stencil.ends) ends += state_.filled[u];
    for (int u : stencil.opposite) opposite += u >= 0 ? state_.filled[u] : 0;
    ForCodedSiblings(edge, [&](int u) {
      siblings += state_.filled[u];
      ++known;
    });
    state_.filled[v] = models_.Ask(coder_, state_.filled[v] != 0, HeightModels::kFilled,
                                   ends * 3 + opposite, siblings * 5 + known);
  }

  template <typename Visit>
  void ForCodedSiblings(int edge, const Visit& visit) const {
    for (int side = 0; side < 2; ++side) {
      const int face = topology_.edge_faces(side, edge);
      if (face < 0) break;
      for (int k = 0; k < 3; ++k) {
        const int sibling = topology_.face_edges(k, face);
        const int v = topology_.vertex_count + sibling;
        if (sibling < edge && Own(v)) visit(v);
      }
    }
  }

  // ---- which blocks have coefficients
  void CodeBlock(int j, int f, bool implied) {
    const int begin = EdgeBegin(j, f), end = EdgeEnd(j, f);
    if (!HasOwn(begin, end)) return;
    if (level_ > 1 && !implied && !CodeActive(j, f)) return;
    active_[j][f] = 1;
    if (j < leaf_level()) {
      bool any = false;
      for (int k = 0; k < 4; ++k) {
        CodeBlock(j + 1, 4 * f + k, k == 3 && !any);
        any = any || active_[j + 1][4 * f + k] != 0;
      }
      return;
    }
    for (int e = begin; e < end; ++e) {
      if (Own(topology_.vertex_count + e)) CodeEdge(e);
    }
  }

  bool CodeActive(int j, int f) {
    const MeshTopology& faces = refinement_.levels[j];
    // What the level before had here: flags, or at its finest faces the coefficients themselves.
    const auto before = [&](int face) -> int {
      if (j < static_cast<int>(state_.active.size()) && j < leaf_level()) {
        return state_.active[j][face];
      }
      int count = 0;
      for (int k = 0; k < 3; ++k) {
        count += state_.coefficients[faces.vertex_count + faces.face_edges(k, face)] != 0;
      }
      return count;
    };
    int near = 0, known = 0, around = 0;
    for (int k = 0; k < 3; ++k) {
      const int neighbor = faces.face_neighbors(k, f);
      if (neighbor < 0) continue;
      around += before(neighbor) != 0;
      if (neighbor > f) continue;
      near += active_[j][neighbor];
      ++known;
    }
    const int depth = std::min(3, leaf_level() - j);
    const bool coded =
        models_.Ask(coder_, chooser_.Active(j, f), HeightModels::kActive,
                    (depth * 4 + before(f)) * 4 + near, (near * 4 + known) * 4 + around);
    return coded;
  }

  // ---- coefficients
  void CodeEdge(int edge) {
    const int v = topology_.vertex_count + edge;
    const std::vector<int32_t>& q = state_.coefficients;
    const std::array<int, 2> ends = {topology_.edge_vertices(0, edge),
                                     topology_.edge_vertices(1, edge)};
    std::array<int, 2> opposite = {-1, -1};
    int64_t near_sum = 0, lean_sum = 0;
    int known = 0;
    for (int side = 0; side < 2; ++side) {
      const int face = topology_.edge_faces(side, edge);
      if (face < 0) break;
      const int corner = CornerOfEdge(topology_, face, edge);
      opposite[side] = topology_.faces((corner + 2) % 3, face);
      for (int k = 1; k <= 2; ++k) {
        const int sibling = topology_.face_edges((corner + k) % 3, face);
        const int u = topology_.vertex_count + sibling;
        if (sibling >= edge || !Own(u)) continue;
        near_sum += std::abs(q[u]);
        lean_sum += q[u];
        ++known;
      }
    }
    const int64_t ends_sum = int64_t{q[ends[0]]} + q[ends[1]];
    int64_t opposite_sum = 0;
    int64_t coarse_sum = 2 * (int64_t{std::abs(q[ends[0]])} + std::abs(q[ends[1]]));
    int64_t rough = 0;
    if (opposite[1] >= 0) {
      coarse_sum += int64_t{std::abs(q[opposite[0]])} + std::abs(q[opposite[1]]);
      opposite_sum = int64_t{q[opposite[0]]} + q[opposite[1]];
      const std::vector<int32_t>& h = state_.heights;
      rough = int64_t{h[ends[0]]} + h[ends[1]] - h[opposite[0]] - h[opposite[1]];
    }
    const int coarse = MagnitudeClass(coarse_sum, 15);
    const int near = known > 0 ? MagnitudeClass(4 * near_sum / known, 15) : coarse;
    const int lean = Sign(lean_sum);
    const int coarser_count =
        level_ > 1 ? refinement_.levels[level_ - 2].vertex_count : topology_.vertex_count;
    const int inner = ends[0] >= coarser_count ? 1 : 0;
    const int bend = MagnitudeClass(4 * std::abs(rough) / step_, 15);
    const int recent = MagnitudeClass(recent_ >> 4, 15);
    Contexts contexts = {(near * 3 + lean) * 2 + inner, coarse * 16 + near,
                         bend * 8 + std::min(coarse / 2, 7), recent * 4 + std::min(near / 2, 3)};
    // A filled height hardly ever needs a coefficient, only where it bears on measured ones.
    if (state_.filled[v] != 0) contexts = {16 * 6, contexts[1], 16 * 8, 16 * 4};
    Put(v, models_.edges, contexts,
        {(lean * 3 + Sign(ends_sum)) * 3 + Sign(opposite_sum),
         (Sign(rough) * 3 + std::min(bend / 3, 2)) * 3 + lean,
         Sign(lean_sum + ends_sum + opposite_sum)});
    recent_ += (64 * std::abs(q[v]) - recent_) / 8;
  }

  // 0, 1, 2 for negative, none, positive.
  static int Sign(int64_t sum) { return sum > 0 ? 2 : sum < 0 ? 0 : 1; }

  void Put(int v, HeightModels::Coefficients& model, const Contexts& contexts,
           const HeightModels::SignContexts& sign_contexts) {
    const int32_t chosen = chooser_.Choose(v, model, contexts);
    const int32_t coded = model.CodeWithSign(coder_, chosen, contexts, [&](bool negative) {
      return models_.AskSign(coder_, negative, sign_contexts);
    });
    in_range_ = in_range_ && std::abs(coded) <= kMaxCoefficient;
    state_.coefficients[v] = in_range_ ? coded : 0;
  }

  Coder& coder_;
  Chooser& chooser_;
  const LoopRefinement& refinement_;
  const MeshTopology& topology_;
  int level_;
  int32_t step_;
  bool has_filled_;
  HeightModels& models_;
  HeightState& state_;
  const uint8_t* foreign_;
  std::vector<int> leaf_edges_;
  std::vector<std::vector<uint8_t>> active_;
  int64_t recent_ = 0;
  bool in_range_ = true;
};

// A decoder's chooser.
struct NoChoice {
  bool Active(int /*j*/, int /*f*/) const { return false; }
  int32_t Choose(int /*v*/, const HeightModels::Coefficients& /*model*/,
                 const HeightModels::Coefficients::Contexts& /*contexts*/) const {
    return 0;
  }
};

}  // namespace rilievo
