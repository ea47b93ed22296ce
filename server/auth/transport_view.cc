#include "server/auth/transport_view.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "grpc/grpc.h"
#include "grpc/support/alloc.h"
#include "server/os/tcp_connection.h"

namespace rilievo {
namespace {

using nlohmann::json;

// The answer of a function of gRPC, which wants it freed; null when there is none.
json Parsed(char* answer) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(answer, &gpr_free);
  return owned ? json::parse(owned.get(), nullptr, /*allow_exceptions=*/false) : json();
}

// Protobuf's JSON: numbers of 64 bits are strings, zeros are left out.
int64_t Number(const json& object, const char* name) {
  int64_t value = 0;
  const auto found = object.find(name);
  if (found == object.end()) return 0;
  if (found->is_string() && absl::SimpleAtoi(found->get<std::string>(), &value)) return value;
  return found->is_number_integer() ? found->get<int64_t>() : 0;
}

json Member(const json& object, const char* name) {
  return object.is_object() ? object.value(name, json::object()) : json::object();
}

json SocketOf(intptr_t id) { return Member(Parsed(grpc_channelz_get_socket(id)), "socket"); }

std::string PeerOf(const json& socket) {
  const json address = Member(Member(socket, "remote"), "tcpip_address");
  std::string bytes;
  if (!absl::Base64Unescape(address.value("ip_address", std::string()), &bytes)) return "";
  return PeerKey(bytes, static_cast<int>(Number(address, "port")));
}

}  // namespace

TransportView::TransportView() {
  // The numbers of servers grow.
  for (bool end = false; !end;) {
    const json page = Parsed(grpc_channelz_get_servers(server_ + 1));
    end = !page.is_object() || page.value("end", false) || !page.contains("server");
    for (const json& server : page.is_object() ? page.value("server", json::array()) : json()) {
      server_ = std::max<intptr_t>(server_, Number(Member(server, "ref"), "serverId"));
    }
  }
}

std::optional<TransportStreams> TransportView::Of(const std::string& peer) {
  const auto found = sockets_.find(peer);
  if (found == sockets_.end()) return std::nullopt;
  const json data = Member(SocketOf(found->second), "data");
  if (data.empty()) return std::nullopt;
  return TransportStreams{.started = Number(data, "streamsStarted"),
                          .ended = Number(data, "streamsSucceeded") + Number(data, "streamsFailed"),
                          .messages = Number(data, "messagesReceived")};
}

void TransportView::Refresh(const std::set<std::string>& open) {
  // A number is given out a little before its connection is listed.
  constexpr intptr_t kPage = 500, kLate = 100;
  std::erase_if(sockets_, [&](const auto& socket) { return !open.contains(socket.first); });
  std::erase_if(peers_, [&](const auto& peer) { return !open.contains(peer.second); });
  intptr_t from = std::max<intptr_t>(0, last_socket_ - kLate);
  for (bool end = false; !end;) {
    const json page = Parsed(grpc_channelz_get_server_sockets(server_, from, kPage));
    if (!page.is_object()) return;
    end = page.value("end", false) || !page.contains("socketRef");
    for (const json& reference : page.value("socketRef", json::array())) {
      const auto id = static_cast<intptr_t>(Number(reference, "socketId"));
      from = std::max(from, id + 1);
      if (peers_.contains(id)) continue;
      const std::string peer = PeerOf(SocketOf(id));
      sockets_[peer] = id;
      peers_[id] = peer;
    }
  }
  last_socket_ = std::max(last_socket_, from);
}

}  // namespace rilievo
