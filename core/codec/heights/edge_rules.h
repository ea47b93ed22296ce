// The rules that predict the value of an edge's new vertex from the vertices around the edge.
#pragma once

#include <array>
#include <cstdint>

#include "core/surface/edge_stencil.h"

namespace rilievo {

// Weights in 1/32: for each of the two ends, the two opposite vertices, the four wings. An encoder
// names the best one for the level in its bytes, so the order of the table is part of the format.
struct EdgeRule {
  int ends, opposite, wings;
};
inline constexpr std::array<EdgeRule, 4> kEdgeRules = {{
    {16, 0, 0},   // the middle of the ends
    {16, 4, -2},  // the butterfly scheme
    {16, 2, -1},  // halfway between these two
    {12, 4, 0},   // Loop's own edge rule
}};

// The rule where its stencil is there, the middle of the ends elsewhere.
inline EdgeRule RuleAt(const EdgeRule& rule, const EdgeStencil& stencil) {
  const bool reaches = stencil.interior() && (rule.wings == 0 || stencil.complete());
  return reaches ? rule : kEdgeRules[0];
}

// 32 times the prediction. `values` is indexed by vertex.
template <typename Values>
auto WeightedSum(const EdgeRule& rule, const EdgeStencil& stencil, const Values& values) {
  auto sum = rule.ends * (values[stencil.ends[0]] + values[stencil.ends[1]]);
  if (rule.opposite != 0) {
    sum += rule.opposite * (values[stencil.opposite[0]] + values[stencil.opposite[1]]);
  }
  if (rule.wings != 0) {
    sum += rule.wings * (values[stencil.wings[0]] + values[stencil.wings[1]] +
                         values[stencil.wings[2]] + values[stencil.wings[3]]);
  }
  return sum;
}

}  // namespace rilievo
