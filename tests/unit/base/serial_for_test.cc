#include "core/base/serial_for.h"

#include <gtest/gtest.h>

#include <stop_token>

namespace rilievo {
namespace {

TEST(SerialForTest, TakesTheStepsInTurn) {
  int64_t next = 0;
  ASSERT_TRUE(SerialFor(20001, RunContext{}, [&](int64_t i) { EXPECT_EQ(i, next++); }).ok());
  EXPECT_EQ(next, 20001);
  ASSERT_TRUE(SerialFor(0, RunContext{}, [&](int64_t) { ++next; }).ok());
  EXPECT_EQ(next, 20001);
}

TEST(SerialForTest, StopsOnTheWay) {
  std::stop_source source;
  RunContext context;
  context.stop = source.get_token();
  int64_t steps = 0;
  const absl::Status status = SerialFor(1000000, context, [&](int64_t i) {
    if (i == 100) source.request_stop();
    ++steps;
  });
  EXPECT_EQ(status.code(), absl::StatusCode::kCancelled);
  EXPECT_LT(steps, 20000);
}

}  // namespace
}  // namespace rilievo
