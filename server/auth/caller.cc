#include "server/auth/caller.h"

#include <arpa/inet.h>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace rilievo {
namespace {

constexpr size_t kFourBytes = 4, kPrefixBytes = 8, kMappedBytes = 12, kSixBytes = 16;

// "2001:db8::1" of "%5B2001:db8::1%5D:4711", of "[2001:db8::1]:4711" and of
// "[fe80::1%25eth0]:4711".
std::string AddressOfSix(const std::string& path) {
  const std::string plain =
      absl::StrReplaceAll(path, {{"%5B", "["}, {"%5D", "]"}, {"%5b", "["}, {"%5d", "]"}});
  const size_t end = plain.rfind(']');
  if (plain.empty() || plain[0] != '[' || end == std::string::npos) return "";
  const std::string address = plain.substr(1, end - 1);
  return address.substr(0, address.find('%'));
}

}  // namespace

std::string HouseholdOf(const in6_addr& address) {
  const char* bytes = reinterpret_cast<const char*>(address.s6_addr);
  if (IN6_IS_ADDR_V4MAPPED(&address)) return {bytes + kMappedBytes, kFourBytes};
  return {bytes, kPrefixBytes};
}

std::string MachineOfPeer(const std::string& peer) {
  if (absl::StartsWith(peer, "ipv4:")) {
    const size_t colon = peer.rfind(':');
    return colon > 4 ? peer.substr(0, colon) : peer;
  }
  in6_addr address{};
  if (!absl::StartsWith(peer, "ipv6:") ||
      inet_pton(AF_INET6, AddressOfSix(peer.substr(5)).c_str(), &address) != 1) {
    return peer;
  }
  std::string household = HouseholdOf(address);
  const bool four = household.size() == kFourBytes;
  household.resize(kSixBytes);
  char text[INET6_ADDRSTRLEN];
  inet_ntop(four ? AF_INET : AF_INET6, household.data(), text, sizeof(text));
  return four ? absl::StrCat("ipv4:", text) : absl::StrCat("ipv6:[", text, "]/64");
}

}  // namespace rilievo
