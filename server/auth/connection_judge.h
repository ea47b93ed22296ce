// Which connections cost the server more than any honest client's does.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/auth/transport_view.h"
#include "server/os/tcp_connection.h"

namespace rilievo {

// A connection as it is now.
struct ConnectionState {
  uint64_t number = 0;  // in the order in which they came
  std::string address;  // whom it counts for
  TcpTraffic traffic;
  std::optional<TransportStreams> streams;  // nothing: as they were at the last look
};

struct Offence {
  uint64_t number = 0;  // of the connection
  std::string words;    // what it did, with figures
};

// Looks at figures; closes nothing. For one thread.
class ConnectionJudge {
 public:
  using Clock = std::chrono::steady_clock;

  struct Limits {
    int64_t connection_streams = 128;  // calls under way on one connection
    int64_t open_calls = 2048;         // on all connections
    int64_t memory = 512'000'000;      // resident, of the server, bytes
  };
  // Calls beyond `connection_streams` that a client may have begun before it learns of the limit.
  static constexpr int64_t kUnawareStreams = 256;
  // An open call takes, as gRPC 1.51 was measured.
  static constexpr int64_t kCallBytes = 20'000;
  // That a connection may bring without ending a message or beginning a call. gRPC holds 24 MiB of
  // unfinished messages for all connections together; then it cancels a call, and more is on its
  // way.
  static constexpr int64_t kSilentBytes = 40 << 20;
  // That it may bring for kDeafTime while the server sends nothing to it and no message ends. Data
  // of calls makes the server widen their window; headers without an end do not, and gRPC 1.51
  // copies what it has of them at each frame. A call that does not read looks the same for as long
  // as its window lasts: so few bytes count only while the processors work more than they explain,
  // else kManyDeafBytes.
  static constexpr int64_t kDeafBytes = 256 << 10, kManyDeafBytes = 5 << 20;
  static constexpr std::chrono::milliseconds kDeafTime{100};

  explicit ConnectionJudge(const Limits& limits) : limits_(limits) {}

  // Connections that should be closed; they are forgotten here. `all`: every one that is open.
  // `busy`: whether the server uses the processors more than the bytes it received explain.
  // `resident`: its memory, less what it knows to hold for clients.
  std::vector<Offence> Judge(const std::vector<ConnectionState>& all, bool busy, int64_t resident,
                             Clock::time_point now);

 private:
  struct Known {
    std::string address;
    TransportStreams streams;
    TcpTraffic traffic;
    int64_t read_at_progress = 0;  // when a message ended or a call began last
    int64_t read_at_sent = 0;      // when the server sent something last
    Clock::time_point sent;
    bool reads = false;  // something was read since the last look

    int64_t silent() const { return traffic.read - read_at_progress; }
    int64_t cost() const { return streams.open() * kCallBytes + silent(); }
  };
  using Map = std::map<uint64_t, Known>;

  void Learn(const std::vector<ConnectionState>& all, Clock::time_point now);
  static void LearnOf(const ConnectionState& state, Clock::time_point now, Known* one);
  std::optional<std::string> OwnOffence(const Known& one, bool busy, Clock::time_point now) const;
  // Of the address that costs most, the connection that does; none when none costs as much as a
  // call.
  Map::iterator Costliest();

  const Limits limits_;
  Map known_;
};

}  // namespace rilievo
