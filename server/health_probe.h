// One question to a server's health service: for container health checks and scripts.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/status.h"

namespace rilievo {

// OK when the server at "host:port" says SERVING of `service`, "" for all of it; UNAVAILABLE when
// it says otherwise; else the error of the call. Asks in plaintext, then over TLS, in half of
// `timeout` each. Any certificate will do: nothing is told that is secret.
absl::Status ProbeHealth(const std::string& address, std::chrono::milliseconds timeout,
                         const std::string& service = "");

}  // namespace rilievo
