#include "server/doors/caller.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(Caller, TurnsAreTheMachinesNotThePorts) {
  EXPECT_EQ(MachineOfPeer("ipv4:10.0.0.1:4711"), "ipv4:10.0.0.1");
  EXPECT_EQ(MachineOfPeer("ipv6:[::1]:4711"), "ipv6:[::1]");
  EXPECT_EQ(MachineOfPeer("inproc"), "inproc");
  EXPECT_EQ(MachineOfPeer("unix:/run/x:1"), "unix:/run/x:1");
  EXPECT_EQ(MachineOfPeer("ipv4:"), "ipv4:");
}

}  // namespace
}  // namespace rilievo
