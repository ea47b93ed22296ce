#include "core/pipeline/run_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <map>
#include <stop_token>
#include <thread>
#include <utility>

namespace rilievo {
namespace {

using Bytes = std::vector<uint8_t>;

constexpr int kCount = 50;

// Each part's result is its own number.
PartsOfStep PartsInto(std::map<int, Bytes>* taken) {
  PartsOfStep parts;
  parts.step = PartStep::kHeights;
  parts.count = kCount;
  parts.make = [](int part, const RunContext&) { return Bytes{static_cast<uint8_t>(part)}; };
  parts.take = [taken](int part, std::span<const uint8_t> bytes) {
    EXPECT_TRUE(taken->emplace(part, Bytes(bytes.begin(), bytes.end())).second) << part;
    return absl::OkStatus();
  };
  return parts;
}

// So that a thread that does not run for a moment is not overtaken by all parts.
void TakeTime() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

void ExpectAllTaken(const std::map<int, Bytes>& taken) {
  ASSERT_EQ(taken.size(), size_t{kCount});
  for (const auto& [part, bytes] : taken) EXPECT_EQ(bytes, Bytes{static_cast<uint8_t>(part)});
}

PartsRun Alone(std::vector<double>* told) {
  return {.told = [told](double share) { told->push_back(share); }};
}

class RunPartsAlone : public ::testing::TestWithParam<int> {
 protected:
  RunContext Context() const {
    RunContext context;
    context.threads = GetParam();
    return context;
  }
};

TEST_P(RunPartsAlone, TakesEachPartOnce) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  ASSERT_TRUE(RunParts(PartsInto(&taken), Alone(&told), Context()).ok());
  ExpectAllTaken(taken);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_TRUE(std::all_of(told.begin(), told.end(), [](double s) { return s >= 0 && s < 1; }));
}

TEST_P(RunPartsAlone, MakesOneAtATimeWithAllThreadsWhereMoreDoNotFit) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsOfStep parts = PartsInto(&taken);
  parts.at_once = 1;
  std::atomic<int> making = 0;
  parts.make = [&](int part, const RunContext& own) {
    EXPECT_EQ(++making, 1);
    EXPECT_EQ(own.threads, GetParam());
    TakeTime();
    --making;
    return Bytes{static_cast<uint8_t>(part)};
  };
  ASSERT_TRUE(RunParts(parts, Alone(&told), Context()).ok());
  ExpectAllTaken(taken);
}

TEST_P(RunPartsAlone, MakesNoPartThatIsThere) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsOfStep parts = PartsInto(&taken);
  parts.is_there = [](int part) { return part % 3 != 0; };
  ASSERT_TRUE(RunParts(parts, Alone(&told), Context()).ok());
  ASSERT_EQ(taken.size(), size_t{(kCount + 2) / 3});
  for (const auto& [part, bytes] : taken) EXPECT_EQ(part % 3, 0);
}

TEST_P(RunPartsAlone, APartThatCannotBeMadeEndsTheRun) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsOfStep parts = PartsInto(&taken);
  std::atomic<int> made = 0;
  parts.make = [&](int part, const RunContext&) -> absl::StatusOr<Bytes> {
    ++made;
    if (part == 7) return absl::ResourceExhaustedError("the disk is full");
    TakeTime();
    return Bytes{static_cast<uint8_t>(part)};
  };
  const absl::Status status = RunParts(parts, Alone(&told), Context());
  EXPECT_EQ(status, absl::ResourceExhaustedError("the disk is full"));
  EXPECT_FALSE(taken.contains(7));
  EXPECT_LT(made, kCount);
}

TEST_P(RunPartsAlone, APartThatCannotBeTakenEndsTheRun) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsOfStep parts = PartsInto(&taken);
  parts.make = [](int part, const RunContext&) {
    if (part != 7) TakeTime();
    return Bytes{static_cast<uint8_t>(part)};
  };
  const auto take = std::exchange(parts.take, {});
  parts.take = [&](int part, std::span<const uint8_t> bytes) {
    return part == 7 ? NotOfPart(parts.step, part) : take(part, bytes);
  };
  const absl::Status status = RunParts(parts, Alone(&told), Context());
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_LT(taken.size(), size_t{kCount - 1});
}

TEST_P(RunPartsAlone, StopsBetweenParts) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsOfStep parts = PartsInto(&taken);
  std::stop_source source;
  const auto take = std::exchange(parts.take, {});
  parts.take = [&](int part, std::span<const uint8_t> bytes) {
    source.request_stop();
    return take(part, bytes);
  };
  RunContext context = Context();
  context.stop = source.get_token();
  EXPECT_EQ(RunParts(parts, Alone(&told), context).code(), absl::StatusCode::kCancelled);
  EXPECT_LT(taken.size(), size_t{kCount});
}

INSTANTIATE_TEST_SUITE_P(Threads, RunPartsAlone, ::testing::Values(1, 2, 3));

// Others have done the parts from `first_of_others` on.
class PartsWithOthers : public SharedParts {
 public:
  PartsWithOthers(bool leads, int first_of_others)
      : leads_(leads), next_of_others_(first_of_others) {
    for (int part = first_of_others; part < kCount; ++part) {
      kept[part] = {static_cast<uint8_t>(part)};
    }
  }
  bool leads() const override { return leads_; }
  absl::StatusOr<Turn> Next(PartStep, int count) override {
    EXPECT_EQ(count, kCount);
    Turn turn;
    turn.done = static_cast<int>(kept.size());
    if (next_ < next_of_others_) turn.part = next_++;
    return turn;
  }
  absl::Status Keep(PartStep, int part, const PieceSource& next) override {
    for (;;) {
      const auto piece = next();
      if (!piece.ok() || piece->empty()) return piece.status();
      kept[part].insert(kept[part].end(), piece->begin(), piece->end());
    }
  }
  absl::Status Fetch(PartStep, int part, const PieceSink& take) override {
    ++fetched;
    for (const uint8_t byte : kept.at(part)) {
      if (absl::Status status = take({&byte, 1}); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  std::map<int, Bytes> kept;
  int fetched = 0;

 private:
  bool leads_;
  int next_ = 0, next_of_others_;
};

TEST(RunPartsSharedTest, WhoLeadsTakesWhatOthersHaveDone) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsWithOthers shared(/*leads=*/true, 20);
  PartsRun run = Alone(&told);
  run.shared = &shared;
  ASSERT_TRUE(RunParts(PartsInto(&taken), run, RunContext()).ok());
  ExpectAllTaken(taken);
  EXPECT_EQ(shared.kept, taken);
  EXPECT_EQ(shared.fetched, kCount - 20);
  EXPECT_EQ(told.back(), 1);
}

TEST(RunPartsSharedTest, WhoHelpsTakesOnlyWhatLaterStepsNeed) {
  for (const PartStep step : {PartStep::kFit, PartStep::kHeights, PartStep::kMeasured}) {
    std::map<int, Bytes> taken;
    std::vector<double> told;
    PartsWithOthers shared(/*leads=*/false, 20);
    PartsRun run = Alone(&told);
    run.shared = &shared;
    PartsOfStep parts = PartsInto(&taken);
    parts.step = step;
    ASSERT_TRUE(RunParts(parts, run, RunContext()).ok());
    EXPECT_EQ(shared.kept.size(), size_t{kCount});
    EXPECT_EQ(taken.size(), step == PartStep::kMeasured ? 0 : size_t{kCount});
  }
}

TEST(RunPartsSharedTest, APartThatCannotBeMadeIsNotKept) {
  std::map<int, Bytes> taken;
  std::vector<double> told;
  PartsWithOthers shared(/*leads=*/true, kCount);
  PartsRun run = Alone(&told);
  run.shared = &shared;
  PartsOfStep parts = PartsInto(&taken);
  parts.make = [](int part, const RunContext&) -> absl::StatusOr<Bytes> {
    if (part == 7) return absl::ResourceExhaustedError("the disk is full");
    return Bytes{static_cast<uint8_t>(part)};
  };
  EXPECT_EQ(RunParts(parts, run, RunContext()), absl::ResourceExhaustedError("the disk is full"));
  EXPECT_EQ(shared.kept.size(), size_t{7});
}

}  // namespace
}  // namespace rilievo
