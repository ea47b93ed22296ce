#include "server/rpc/machine_health.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace rilievo {
namespace {

using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(MachineHealth, PausesGrowAndEndWithTheFirstJobThatIsWorkedOn) {
  MachineHealth health;
  std::vector<milliseconds> pauses;
  for (int i = 0; i < 5; ++i) pauses.push_back(*health.Judge(absl::UnavailableError("")));
  EXPECT_THAT(pauses, ElementsAre(milliseconds(100), milliseconds(500), milliseconds(2500),
                                  milliseconds(5000), milliseconds(5000)));
  EXPECT_EQ(health.Judge(absl::CancelledError()), std::nullopt);
  EXPECT_EQ(health.Judge(absl::UnavailableError("")), milliseconds(5000));
  EXPECT_EQ(health.Judge(absl::InvalidArgumentError("flat")), milliseconds(0));
  EXPECT_EQ(health.Judge(absl::UnavailableError("")), milliseconds(100));
}

TEST(MachineHealth, TheThirdFailureInARowIsTold) {
  MachineHealth health;
  std::vector<bool> told;
  health.Watch([&](bool able) { told.push_back(able); });
  for (const int failures : {2, 3, 9}) {
    told.clear();
    for (int i = 0; i < failures; ++i) health.Judge(absl::UnavailableError(""));
    health.Judge(absl::OkStatus());
    health.Judge(absl::OkStatus());
    if (failures < 3) {
      EXPECT_THAT(told, IsEmpty());
    } else {
      EXPECT_THAT(told, ElementsAre(false, true));
    }
  }
  health.Watch({});
  for (int i = 0; i < 3; ++i) health.Judge(absl::UnavailableError(""));
  EXPECT_EQ(told.size(), 2u);
}

}  // namespace
}  // namespace rilievo
