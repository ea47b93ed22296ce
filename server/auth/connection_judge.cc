#include "server/auth/connection_judge.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace rilievo {

void ConnectionJudge::LearnOf(const ConnectionState& state, Clock::time_point now, Known* one) {
  one->reads = state.traffic.read > one->traffic.read;
  if (state.traffic.sent != one->traffic.sent) {
    one->read_at_sent = state.traffic.read;
    one->sent = now;
  }
  one->traffic = state.traffic;
  if (!state.streams) return;
  if (state.streams->messages != one->streams.messages ||
      state.streams->started != one->streams.started) {
    one->read_at_progress = state.traffic.read;
  }
  one->streams = *state.streams;
}

void ConnectionJudge::Learn(const std::vector<ConnectionState>& all, Clock::time_point now) {
  Map open;
  for (const ConnectionState& state : all) {
    const auto found = known_.find(state.number);
    Known one;
    if (found != known_.end()) {
      one = std::move(found->second);
    } else {
      one.address = state.address;
      one.sent = now;
    }
    LearnOf(state, now, &one);
    open.emplace(state.number, std::move(one));
  }
  known_ = std::move(open);
}

std::optional<std::string> ConnectionJudge::OwnOffence(const Known& one, bool busy,
                                                       Clock::time_point now) const {
  if (one.streams.open() > limits_.connection_streams + kUnawareStreams) {
    return absl::StrCat(one.streams.open(), " calls under way where ", limits_.connection_streams,
                        " are allowed");
  }
  if (one.silent() > kSilentBytes) {
    return absl::StrCat(one.silent(), " bytes without a whole message");
  }
  const int64_t deaf = std::min(one.traffic.read - one.read_at_sent, one.silent());
  if (one.reads && deaf > (busy ? kDeafBytes : kManyDeafBytes) && now - one.sent >= kDeafTime) {
    return absl::StrCat(deaf, " bytes of headers without an end");
  }
  return std::nullopt;
}

ConnectionJudge::Map::iterator ConnectionJudge::Costliest() {
  std::map<std::string, int64_t> of_address;
  for (const auto& [number, one] : known_) of_address[one.address] += one.cost();
  auto most = known_.end();
  for (auto at = known_.begin(); at != known_.end(); ++at) {
    if (at->second.cost() < kCallBytes) continue;
    const auto weight = [&](const auto& entry) {
      return std::pair(of_address[entry->second.address], entry->second.cost());
    };
    // The youngest of equals.
    if (most == known_.end() || weight(at) >= weight(most)) most = at;
  }
  return most;
}

std::vector<Offence> ConnectionJudge::Judge(const std::vector<ConnectionState>& all, bool busy,
                                            int64_t resident, Clock::time_point now) {
  Learn(all, now);
  std::vector<Offence> offences;
  int64_t open_calls = 0;
  for (auto at = known_.begin(); at != known_.end();) {
    const auto one = at++;
    if (auto words = OwnOffence(one->second, busy, now)) {
      offences.push_back({one->first, *std::move(words)});
      known_.erase(one);
    } else {
      open_calls += one->second.streams.open();
    }
  }
  int64_t excess = resident - limits_.memory;
  while (open_calls > limits_.open_calls || excess > 0) {
    const auto one = Costliest();
    if (one == known_.end()) break;
    offences.push_back(
        {one->first, open_calls > limits_.open_calls
                         ? absl::StrCat(open_calls,
                                        " calls under way on all connections, most of "
                                        "them of this address")
                         : absl::StrCat("the server takes ", resident,
                                        " bytes, and this connection costs most")});
    open_calls -= one->second.streams.open();
    excess -= one->second.cost();
    known_.erase(one);
  }
  return offences;
}

}  // namespace rilievo
