#include "server/rpc/client_places.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

int TakeAll(ClientPlaces* places, const std::string& client) {
  int taken = 0;
  while (places->Take(client)) ++taken;
  return taken;
}

TEST(ClientPlaces, OneClientGetsHalfAndLeavesRoomForOthers) {
  ClientPlaces places(64);
  EXPECT_EQ(TakeAll(&places, "a"), 32);
  EXPECT_EQ(TakeAll(&places, "b"), 16);
  EXPECT_EQ(TakeAll(&places, "c"), 8);
  EXPECT_FALSE(places.Take("a"));
  EXPECT_TRUE(places.Take("newcomer"));
}

TEST(ClientPlaces, AFewPlaces) {
  ClientPlaces one(1), two(2);
  EXPECT_EQ(TakeAll(&one, "a"), 1);
  EXPECT_EQ(TakeAll(&one, "b"), 0);
  EXPECT_EQ(TakeAll(&two, "a"), 1);
  EXPECT_EQ(TakeAll(&two, "b"), 1);
}

TEST(ClientPlaces, WhatIsGivenBackCanBeTaken) {
  ClientPlaces places(4);
  EXPECT_EQ(TakeAll(&places, "a"), 2);
  places.Give("a");
  EXPECT_EQ(TakeAll(&places, "a"), 1);
  places.Give("a");
  places.Give("a");
  EXPECT_EQ(TakeAll(&places, "b"), 2);
}

}  // namespace
}  // namespace rilievo
