#include "server/observability/port/metrics_port.h"

#include <prometheus/collectable.h>
#include <prometheus/text_serializer.h>

#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

std::string Http(std::string_view status, const std::string& type, const std::string& body) {
  return absl::StrCat("HTTP/1.1 ", absl::string_view(status.data(), status.size()),
                      "\r\nContent-Type: ", type, "\r\nContent-Length: ", body.size(),
                      "\r\nConnection: close\r\n\r\n", body);
}

std::string AnswerTo(std::string_view head, const prometheus::Collectable& metrics) {
  const absl::string_view request(head.data(), head.size());
  if (!absl::StartsWith(request, "GET ")) {
    return Http("405 Method Not Allowed", "text/plain", "only GET\n");
  }
  if (!absl::StartsWith(request, "GET /metrics ") && !absl::StartsWith(request, "GET /metrics?")) {
    return Http("404 Not Found", "text/plain", "only /metrics\n");
  }
  return Http("200 OK", "text/plain; version=0.0.4; charset=utf-8",
              prometheus::TextSerializer().Serialize(metrics.Collect()));
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsPort>> MetricsPort::Open(
    const std::string& address, std::shared_ptr<prometheus::Collectable> metrics) {
  auto server = ScrapeServer::Open(
      address, [metrics](std::string_view head) { return AnswerTo(head, *metrics); });
  if (!server.ok()) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve metrics on \"", address,
                     "\"; give HOST:PORT, for example 127.0.0.1:9464, with a port that is free"));
  }
  std::unique_ptr<MetricsPort> port(new MetricsPort);
  port->server_ = *std::move(server);
  port->address_ = absl::StrCat(address.substr(0, address.rfind(':')), ":", port->server_->port());
  return port;
}

}  // namespace rilievo
