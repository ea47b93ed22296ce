// Which addresses never leave this machine.
#pragma once

#include <string>

#include "absl/strings/match.h"

namespace rilievo {

// Whether "host:port", as gRPC takes it, is a loopback address or a socket in the file system.
inline bool IsLocalAddress(const std::string& address) {
  if (absl::StartsWith(address, "unix:") || absl::StartsWith(address, "unix-abstract:")) {
    return true;
  }
  std::string host = address.substr(0, address.rfind(':'));
  if (absl::StartsWith(host, "[") && absl::EndsWith(host, "]")) {
    host = host.substr(1, host.size() - 2);
  }
  if (host == "localhost" || host == "::1") return true;
  // Only as numbers: a name such as 127.example.org may lie anywhere.
  return absl::StartsWith(host, "127.") &&
         host.find_first_not_of("0123456789.") == std::string::npos;
}

}  // namespace rilievo
