#include "core/scan/orientation/signed_graph.h"

#include <gtest/gtest.h>

#include <optional>
#include <stop_token>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

// A grid of nodes with hidden signs; links tell their product, `wrong` of them the opposite.
struct HiddenSigns {
  std::vector<int> sign;
  std::vector<SignedLink> links;
};

HiddenSigns MakeGrid(int width, double wrong, uint64_t seed) {
  Random random(seed);
  HiddenSigns hidden;
  for (int i = 0; i < width * width; ++i) hidden.sign.push_back(random.Uniform() < 0.5 ? 1 : -1);
  const auto link = [&](int a, int b) {
    const double truth = hidden.sign[a] * hidden.sign[b];
    const double weight = random.Uniform(0.5, 1.0) * (random.Uniform() < wrong ? -0.6 : 1.0);
    hidden.links.push_back({a, b, truth * weight});
  };
  for (int y = 0; y < width; ++y) {
    for (int x = 0; x < width; ++x) {
      const int node = y * width + x;
      if (x + 1 < width) link(node, node + 1);
      if (y + 1 < width) link(node, node + width);
      if (x + 1 < width && y + 1 < width) link(node, node + width + 1);
    }
  }
  return hidden;
}

// Nodes whose sign is not the hidden one, up to a common flip.
int Mistakes(const HiddenSigns& hidden, const SignedLabels& labels) {
  int mistakes = 0;
  for (size_t i = 0; i < hidden.sign.size(); ++i) mistakes += labels.sign[i] != hidden.sign[i];
  return std::min<int>(mistakes, static_cast<int>(hidden.sign.size()) - mistakes);
}

TEST(SignedGraphTest, FindsHiddenSignsExactlyWhenLinksAgree) {
  const HiddenSigns hidden = MakeGrid(40, 0.0, 1);
  const auto labels = LabelSignedGraph(1600, hidden.links, {}, {}, RunContext{});
  ASSERT_TRUE(labels.ok());
  EXPECT_EQ(labels->components, 1);
  EXPECT_EQ(Mistakes(hidden, *labels), 0);
}

TEST(SignedGraphTest, OutvotesWrongLinks) {
  for (uint64_t seed = 2; seed < 7; ++seed) {
    const HiddenSigns hidden = MakeGrid(40, 0.05, seed);
    const auto labels = LabelSignedGraph(1600, hidden.links, {}, {}, RunContext{});
    ASSERT_TRUE(labels.ok());
    EXPECT_LE(Mistakes(hidden, *labels), 16) << seed;  // one in a hundred
  }
}

TEST(SignedGraphTest, SumsParallelLinksAndIgnoresLoops) {
  const std::vector<SignedLink> links = {
      {0, 1, 0.9}, {1, 0, -0.5}, {0, 1, -0.5}, {1, 1, 5.0}, {1, 2, 0.3}};
  const auto labels = LabelSignedGraph(3, links, {}, {}, RunContext{});
  ASSERT_TRUE(labels.ok());
  EXPECT_NE(labels->sign[0], labels->sign[1]);
  EXPECT_EQ(labels->sign[1], labels->sign[2]);
}

// 0 - 1 and 2 - 3 are sure; what lies between them is contested, with 0.6 to 0.4.
TEST(SignedGraphTest, RelationDecidesWhereLinksContradictEachOther) {
  const std::vector<SignedLink> links = {{0, 1, -9.0}, {2, 3, 9.0}, {1, 2, 0.6}, {0, 3, 0.4}};
  const auto labels_with = [&links](std::optional<double> agreement,
                                    std::vector<SignedLink> further = {}) {
    const auto says = [agreement](
                          double balance, std::span<const SignedNode> a,
                          std::span<const SignedNode> b) -> absl::StatusOr<std::optional<double>> {
      if (!agreement) return std::nullopt;
      // Relative to the first of the other group, as node 1 and node 2 want it.
      const auto sign_of = [&](int node) {
        for (const auto& group : {a, b}) {
          for (const SignedNode& member : group) {
            if (member.node == node) return member.sign;
          }
        }
        return 0;
      };
      return balance + *agreement * sign_of(1) * sign_of(2);
    };
    further.insert(further.end(), links.begin(), links.end());
    return LabelSignedGraph(4, further, {}, says, RunContext{}).value();
  };
  const auto between = [](const SignedLabels& labels) { return labels.sign[1] * labels.sign[2]; };
  EXPECT_EQ(between(labels_with(0)), 1);
  EXPECT_EQ(between(labels_with(-0.1)), 1);
  EXPECT_EQ(between(labels_with(-0.3)), -1);
  EXPECT_EQ(between(labels_with(-5, {{1, 2, 2.7}})), -1) << "11 % of the weight contradict";
  EXPECT_EQ(between(labels_with(-5, {{1, 2, 3.2}})), 1) << "under a tenth contradicts";
  EXPECT_EQ(labels_with(0).components, 1);
  // They stay apart, unless one more link tells.
  EXPECT_EQ(labels_with(std::nullopt).components, 2);
  const SignedLabels joined = labels_with(std::nullopt, {{1, 3, 5.0}});
  EXPECT_EQ(joined.components, 1);
  EXPECT_EQ(between(joined), 1);
}

// All groups do; counts how often it is asked.
GroupRelation StayApart(int* asked) {
  return [asked](double, std::span<const SignedNode>,
                 std::span<const SignedNode>) -> absl::StatusOr<std::optional<double>> {
    ++*asked;
    return std::nullopt;
  };
}

// Groups that stay apart are asked again once a third one joins either of them.
TEST(SignedGraphTest, GroupsApartAreAskedAgain) {
  int asked = 0;
  const std::vector<SignedLink> links = {{0, 1, 3.0}, {0, 1, -2.0}, {1, 2, -0.5}, {0, 2, -0.5}};
  const SignedLabels labels =
      LabelSignedGraph(3, links, {}, StayApart(&asked), RunContext{}).value();
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(labels.components, 2);
  EXPECT_EQ(labels.sign[0] * labels.sign[2], -1);
}

// A hundred small nodes join the one group, each with a link that adds next to nothing.
TEST(SignedGraphTest, GroupsApartAreNotAskedForEveryLink) {
  int asked = 0;
  std::vector<SignedLink> links = {{0, 1, 300.0}, {0, 1, -200.0}};
  for (int node = 2; node < 102; ++node) {
    links.push_back({0, node, -9.0});
    links.push_back({1, node, -1.0});
  }
  const SignedLabels labels =
      LabelSignedGraph(102, links, {}, StayApart(&asked), RunContext{}).value();
  EXPECT_EQ(labels.components, 2);
  EXPECT_GE(asked, 2);
  EXPECT_LE(asked, 5);
}

// A relation that knows the hidden signs mends all that contested links say wrongly, in any order
// of the links; relative to heads whose sign in their own set is either one.
TEST(SignedGraphTest, RelationThatKnowsTheSignsFindsThem) {
  for (uint64_t seed = 20; seed < 24; ++seed) {
    HiddenSigns hidden = MakeGrid(30, 0.3, seed);
    int asked = 0;
    const auto knows = [&](double balance, std::span<const SignedNode> a,
                           std::span<const SignedNode> b) -> absl::StatusOr<std::optional<double>> {
      ++asked;
      const auto side = [&hidden](std::span<const SignedNode> group) {
        double sum = 0;
        for (const SignedNode& node : group) sum += node.sign * hidden.sign[node.node];
        return sum > 0 ? 1.0 : -1.0;
      };
      return balance + 2 * side(a) * side(b);
    };
    const auto with = LabelSignedGraph(900, hidden.links, {}, knows, RunContext{});
    const auto without = LabelSignedGraph(900, hidden.links, {}, {}, RunContext{});
    std::reverse(hidden.links.begin(), hidden.links.end());
    const auto again = LabelSignedGraph(900, hidden.links, {}, knows, RunContext{});
    ASSERT_TRUE(with.ok() && without.ok() && again.ok());
    EXPECT_GT(asked, 0);
    EXPECT_LT(2 * Mistakes(hidden, *with), Mistakes(hidden, *without)) << seed;
    EXPECT_EQ(with->sign, again->sign);
  }
}

TEST(SignedGraphTest, NumbersComponentsByLowestNode) {
  const std::vector<SignedLink> links = {{4, 2, 1.0}, {1, 3, -1.0}};
  const auto labels = LabelSignedGraph(5, links, {}, {}, RunContext{});
  ASSERT_TRUE(labels.ok());
  EXPECT_EQ(labels->components, 3);
  EXPECT_EQ(labels->component, (std::vector<int>{0, 1, 2, 1, 2}));
}

TEST(SignedGraphTest, OrderOfTheLinksDoesNotMatter) {
  HiddenSigns hidden = MakeGrid(30, 0.2, 8);
  const auto a = LabelSignedGraph(900, hidden.links, {}, {}, RunContext{});
  std::reverse(hidden.links.begin(), hidden.links.end());
  const auto b = LabelSignedGraph(900, hidden.links, {}, {}, RunContext{});
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->sign, b->sign);
}

TEST(SignedGraphTest, Stops) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(LabelSignedGraph(4, {{0, 1, 1.0}}, {}, {}, context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(SignedGraphTest, SidesGiveTheAbsoluteSign) {
  // 0 - 1 same, 1 - 2 opposite, 3 - 4 same; the sides speak of 2 and, more weakly, of 0.
  const std::vector<SignedLink> links = {{0, 1, 1.0}, {1, 2, -2.0}, {3, 4, 1.0}};
  const auto labels = LabelSignedGraph(5, links, {0.5, 0, 3, 0, 0}, {}, RunContext{});
  ASSERT_TRUE(labels.ok());
  EXPECT_EQ(labels->components, 2);
  EXPECT_EQ(labels->sided, labels->component[0]);
  EXPECT_EQ(labels->sign[2], 1);
  EXPECT_EQ(labels->sign[1], -1);
  EXPECT_EQ(labels->sign[0], -1) << "outvoted by its neighbour";
  EXPECT_NE(labels->component[3], labels->sided);
  const auto none = LabelSignedGraph(5, links, {}, {}, RunContext{});
  EXPECT_EQ(none->sided, -1);
}

// As a link to one more node would have it, whose sign is +1.
TEST(SignedGraphTest, SidesAreLinksToOneMoreNode) {
  Random random(4);
  for (int round = 0; round < 50; ++round) {
    constexpr int kNodes = 40;
    std::vector<SignedLink> links;
    for (int i = 0; i < 3 * kNodes; ++i) {
      links.push_back({static_cast<int>(random.Uniform() * kNodes),
                       static_cast<int>(random.Uniform() * kNodes), random.Uniform(-1, 1)});
    }
    std::vector<double> sides(kNodes, 0.0);
    std::vector<SignedLink> with_node = links;
    for (int i = 0; i < kNodes; i += 2) {
      sides[i] = random.Uniform(-2, 2);
      with_node.push_back({i, kNodes, sides[i]});
    }
    const auto a = LabelSignedGraph(kNodes, links, sides, {}, RunContext{});
    const auto b = LabelSignedGraph(kNodes + 1, with_node, {}, {}, RunContext{});
    ASSERT_TRUE(a.ok() && b.ok());
    for (int i = 0; i < kNodes; ++i) {
      const bool sided = b->component[i] == b->component[kNodes];
      EXPECT_EQ(a->component[i] == a->sided, sided);
      if (!sided) continue;
      EXPECT_EQ(a->sign[i], b->sign[i] * b->sign[kNodes]) << round;
    }
  }
}

}  // namespace
}  // namespace rilievo
