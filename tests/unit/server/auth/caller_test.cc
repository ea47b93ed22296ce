#include "server/auth/caller.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

TEST(Caller, TurnsAreTheMachinesNotThePorts) {
  EXPECT_EQ(MachineOfPeer("ipv4:10.0.0.1:4711"), "ipv4:10.0.0.1");
  EXPECT_EQ(MachineOfPeer("inproc"), "inproc");
  EXPECT_EQ(MachineOfPeer("unix:/run/x:1"), "unix:/run/x:1");
  EXPECT_EQ(MachineOfPeer("ipv4:"), "ipv4:");
}

TEST(Caller, AHouseholdOfIpv6IsOne) {
  const std::string one = MachineOfPeer("ipv6:%5B2001:db8:1:2::1%5D:4711");
  EXPECT_EQ(one, "ipv6:[2001:db8:1:2::]/64");
  for (const char* same :
       {"ipv6:%5B2001:db8:1:2:aaaa:bbbb:cccc:dddd%5D:1", "ipv6:[2001:db8:1:2::1]:4712"}) {
    EXPECT_EQ(MachineOfPeer(same), one) << same;
  }
  EXPECT_NE(MachineOfPeer("ipv6:%5B2001:db8:1:3::1%5D:4711"), one);
  EXPECT_EQ(MachineOfPeer("ipv6:[::1]:4711"), "ipv6:[::]/64");
  EXPECT_EQ(MachineOfPeer("ipv6:%5Bfe80::1%25eth0%5D:7"), "ipv6:[fe80::]/64");
  EXPECT_EQ(MachineOfPeer("ipv6:[::ffff:10.0.0.1]:7"), "ipv4:10.0.0.1");
  EXPECT_EQ(MachineOfPeer("ipv6:nonsense"), "ipv6:nonsense");
}

}  // namespace
}  // namespace rilievo
