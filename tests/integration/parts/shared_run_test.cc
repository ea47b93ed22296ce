// A scan on disk whose parts several processes do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "core/paging/scan_pager.h"
#include "core/paging/shared_parts.h"
#include "core/pipeline/pages_to_thin.h"
#include "core/pipeline/reconstruct.h"
#include "tests/integration/parts/long_strip.h"

namespace rilievo {
namespace {

// What processes share, in memory. Parts come in falling order.
class PartsInMemory {
 public:
  // What one of them has of it. It is lost after `lives` parts, and what it had begun with it, or
  // when it comes to a step.
  class Member : public SharedParts {
   public:
    Member(PartsInMemory* all, bool leads, int lives, std::optional<PartStep> last = {})
        : all_(all), leads_(leads), lives_(lives), last_(last) {}
    bool leads() const override { return leads_; }
    absl::StatusOr<Turn> Next(PartStep step, int count) override {
      if (step == last_) return absl::CancelledError("lost");
      std::unique_lock lock(all_->mutex_);
      std::vector<Part>& parts = all_->parts_[step];
      parts.resize(static_cast<size_t>(count));
      for (;;) {
        int done = 0, next = -1;
        for (int part = 0; part < count; ++part) {
          done += !parts[part].bytes.empty();
          const bool may = leads_ || !IsForLeader(step);
          if (parts[part].bytes.empty() && !parts[part].taken && may) next = part;
        }
        if (done == count) return Turn{std::nullopt, done};
        if (next >= 0 && lives_-- == 0) return absl::CancelledError("lost");
        if (next >= 0) {
          parts[next].taken = true;
          ++all_->made_;
          return Turn{next, done};
        }
        all_->changed_.wait(lock);
      }
    }
    absl::Status Keep(PartStep step, int part, const PieceSource& next) override {
      const std::lock_guard lock(all_->mutex_);
      Part& kept = all_->parts_[step][part];
      kept.taken = false;
      const std::span<const uint8_t> bytes = *next();
      if (lives_ > 0) kept.bytes.assign(bytes.begin(), bytes.end());
      all_->changed_.notify_all();
      return lives_ > 0 ? absl::OkStatus() : absl::CancelledError("lost");
    }
    absl::Status Fetch(PartStep step, int part, const PieceSink& take) override {
      const std::lock_guard lock(all_->mutex_);
      return take(all_->parts_[step][part].bytes);
    }

   private:
    PartsInMemory* const all_;
    const bool leads_;
    int lives_;
    const std::optional<PartStep> last_;
  };

  int made() const { return made_; }
  size_t count(PartStep step) { return parts_[step].size(); }
  std::vector<uint8_t>& BytesOf(PartStep step, int part) { return parts_[step][part].bytes; }
  void ForgetAfter(PartStep step) {
    std::erase_if(parts_, [step](const auto& parts) { return parts.first > step; });
  }

 private:
  struct Part {
    bool taken = false;
    std::vector<uint8_t> bytes;
  };
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<PartStep, std::vector<Part>> parts_;
  int made_ = 0;
};

constexpr PartSizes kSizes{.coarse_points = 2000, .part_points = 8192, .block_vertices = 4000};
constexpr int kForEver = 1'000;

class SharedRunTest : public ::testing::Test {
 protected:
  SharedRunTest() {
    context_.threads = 1;
    options_.measure = false;
    options_.max_level = 1;
    options_.control.target_faces = 200;
  }

  PagedScan Paged() const {
    ScanPager pager = ScanPager::Create(::testing::TempDir(), 8192).value();
    EXPECT_TRUE(pager.Add(LongStrip(24'000)).ok());
    return pager.Finish(context_).value();
  }
  absl::StatusOr<std::vector<uint8_t>> Lead(SharedParts* shared) const {
    const auto made = ReconstructPaged(Paged(), kSizes, options_, context_, shared);
    if (!made.ok()) return made.status();
    return made->encoded.Concatenate();
  }
  absl::StatusOr<std::vector<uint8_t>> Lead(int lives, std::optional<PartStep> last = {}) {
    PartsInMemory::Member member(&all_, /*leads=*/true, lives, last);
    return Lead(&member);
  }
  absl::Status Help(int lives, std::optional<PartStep> last = {}) {
    PartsInMemory::Member member(&all_, /*leads=*/false, lives, last);
    return HelpWithParts(Paged(), kSizes, options_, context_, &member);
  }

  RunContext context_;
  ReconstructOptions options_;
  PartsInMemory all_;
};

TEST_F(SharedRunTest, AnyNumberMakesTheSameBytesThoughSomeBeLost) {
  const std::vector<uint8_t> alone = *Lead(nullptr);
  EXPECT_TRUE(absl::IsCancelled(Lead(/*lives=*/3).status()));
  EXPECT_GE(all_.count(PartStep::kSurfels), 2u) << "it was lost among several parts";
  EXPECT_TRUE(absl::IsCancelled(Help(/*lives=*/1)));
  const int before = all_.made();
  std::vector<std::jthread> helpers;
  for (int i = 0; i < 2; ++i) helpers.emplace_back([&] { EXPECT_TRUE(Help(kForEver).ok()); });
  helpers.clear();
  for (const PartStep step : {PartStep::kSurfels, PartStep::kFit, PartStep::kHeights}) {
    EXPECT_GE(all_.count(step), 2u) << "there is something to share";
  }
  const int made = all_.made();
  EXPECT_GT(made, before);
  EXPECT_EQ(*Lead(/*lives=*/2), alone);
  EXPECT_EQ(all_.made(), made + 1) << "all that was left to it is the surface";
  all_.BytesOf(PartStep::kSurfels, 1).pop_back();
  EXPECT_TRUE(absl::IsInternal(Help(/*lives=*/1)));
}

TEST_F(SharedRunTest, WhoeverShapesTheSurfaceTakesWhatOthersHaveLeftOut) {
  const std::vector<uint8_t> alone = *Lead(nullptr);
  EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kCoarse).status()));
  EXPECT_EQ(all_.made(), 1);
  EXPECT_EQ(*Lead(kForEver), alone);
  // As if all points but those of the first page were foliage.
  std::vector<uint8_t>& left_out = all_.BytesOf(PartStep::kLeftOut, 0);
  std::fill(left_out.begin() + kPagePoints / 8, left_out.end(), 0xff);
  all_.ForgetAfter(PartStep::kLeftOut);
  EXPECT_NE(*Lead(kForEver), alone);
  left_out.pop_back();
  EXPECT_TRUE(absl::IsInternal(Lead(kForEver).status()));
}

TEST_F(SharedRunTest, SeveralFindWhatIsLeftOut) {
  ScanPager pager = ScanPager::Create(::testing::TempDir(), 1 << 16).value();
  Eigen::Matrix3Xd points = LongStrip(264'000);
  for (int i = 0; i < points.cols(); i += 100) {
    points.col(i) += 3 * Eigen::Vector3d(std::sin(i), std::sin(1.7 * i), std::sin(2.3 * i));
  }
  ASSERT_TRUE(pager.Add(points).ok());
  const PagedScan pages = pager.Finish(context_).value();
  const auto nobody = [](double) {};
  const std::vector<bool> alone = *LeftOutOfPages(pages, options_, {nobody}, context_);
  EXPECT_GE(std::count(alone.begin(), alone.end(), true), 2000);
  PartsInMemory::Member lost(&all_, /*leads=*/true, /*lives=*/2);
  EXPECT_FALSE(LeftOutOfPages(pages, options_, {nobody, &lost}, context_).ok());
  EXPECT_GE(all_.count(PartStep::kLeftOut), 2u) << "there is something to share";
  PartsInMemory::Member other(&all_, /*leads=*/false, kForEver);
  EXPECT_EQ(*LeftOutOfPages(pages, options_, {nobody, &other}, context_), alone);
  EXPECT_EQ(all_.made(), 3);
}

TEST_F(SharedRunTest, WhoLooksForOutliersTellsOfNoLaterStage) {
  std::vector<Progress> seen;
  context_.progress = [&](const Progress& progress) { seen.push_back(progress); };
  ASSERT_TRUE(Lead(kForEver).ok());
  EXPECT_TRUE(std::is_sorted(
      seen.begin(),
      std::find_if(seen.begin(), seen.end(),
                   [](const Progress& progress) { return progress.stage == Stage::kNormals; }),
      [](const Progress& a, const Progress& b) { return a.stage < b.stage; }));
}

TEST_F(SharedRunTest, ASurfaceIsMeasuredByThoseWhoHelp) {
  options_.measure = true;
  options_.max_level = 3;
  const std::vector<uint8_t> alone = *Lead(nullptr);
  EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kMeasured).status()));
  const int before = all_.made();
  EXPECT_TRUE(Help(kForEver).ok());
  EXPECT_GE(all_.count(PartStep::kMeasured), 2u) << "there is something to share";
  const int made = all_.made();
  EXPECT_EQ(made, before + static_cast<int>(all_.count(PartStep::kMeasured)));
  EXPECT_EQ(*Lead(kForEver), alone);
  EXPECT_EQ(all_.made(), made);
  all_.BytesOf(PartStep::kMeasured, 0).pop_back();
  EXPECT_TRUE(absl::IsInternal(Lead(kForEver).status()));
}

TEST_F(SharedRunTest, ASurfaceIsCodedByThoseWhoHelp) {
  options_.measure = true;
  options_.max_level = 3;
  const std::vector<uint8_t> alone = *Lead(nullptr);
  EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kBlocks).status()));
  EXPECT_EQ(all_.count(PartStep::kUncoded), 1u);
  const int before = all_.made();
  EXPECT_TRUE(absl::IsCancelled(Help(kForEver, PartStep::kCoded)));
  int of_passes = 0, passes = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const auto count =
        static_cast<int>(all_.count(PartStep{static_cast<int>(PartStep::kBlocks) + pass}));
    of_passes += count;
    passes += count > 1;
  }
  EXPECT_GE(passes, 2) << "targets, and groups under them";
  EXPECT_EQ(all_.made(), before + of_passes);
  const int coded = all_.made();
  EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kMeasured).status()));
  EXPECT_EQ(all_.made(), coded + 1) << "all that was left to it is the file";
  EXPECT_EQ(*Lead(kForEver), alone);
  std::vector<uint8_t>& block = all_.BytesOf(PartStep::kBlocks, 0);
  // Behind the numbers of blocks, of bytes, and of rules: what the first rule leaves.
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  const std::vector<uint8_t> whole = block;
  std::memcpy(&block[3 * sizeof(int64_t)], &unknown, sizeof(unknown));
  EXPECT_TRUE(absl::IsInternal(Lead(kForEver).status()));
  block = whole;
  EXPECT_EQ(*Lead(kForEver), alone);
  block.pop_back();
  EXPECT_TRUE(absl::IsInternal(Lead(kForEver).status()));
}

TEST_F(SharedRunTest, WhereBytesOrAnErrorAreAskedForOneAloneCodes) {
  options_.measure = true;
  options_.max_level = 3;
  const auto expect_alone = [&] {
    const std::vector<uint8_t> alone = *Lead(nullptr);
    EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kMeasured).status()));
    EXPECT_EQ(all_.count(PartStep::kBlocks), 0u);
    EXPECT_TRUE(Help(kForEver).ok());
    EXPECT_EQ(*Lead(kForEver), alone);
  };
  options_.encode.max_bytes = 3000;
  expect_alone();
  options_.encode.max_bytes.reset();
  options_.encode.max_error = 0.01;
  all_.ForgetAfter(PartStep::kHeights);
  expect_alone();
}

TEST_F(SharedRunTest, ASurfaceOfOneBlockIsMeasuredInAsManyPartsAsItsPointsAsk) {
  options_.measure = true;
  const std::vector<uint8_t> alone = *Lead(nullptr);
  EXPECT_TRUE(absl::IsCancelled(Lead(kForEver, PartStep::kMeasured).status()));
  EXPECT_TRUE(Help(kForEver).ok());
  EXPECT_GE(all_.count(PartStep::kMeasured), 3u) << "24 000 points, 8 192 a part";
  EXPECT_EQ(*Lead(kForEver), alone);
}

}  // namespace
}  // namespace rilievo
