#include "server/observability/port/metrics_port.h"

#include <prometheus/collectable.h>
#include <prometheus/exposer.h>

#include <exception>
#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr size_t kThreads = 4;  // a connection that says nothing holds one

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsPort>> MetricsPort::Open(
    const std::string& address, std::shared_ptr<prometheus::Collectable> metrics) {
  std::unique_ptr<MetricsPort> port(new MetricsPort);
  port->metrics_ = std::move(metrics);
  try {
    port->exposer_ = std::make_unique<prometheus::Exposer>(address, kThreads);
    port->exposer_->RegisterCollectable(port->metrics_);
    const auto bound = port->exposer_->GetListeningPorts();
    const std::string host = address.substr(0, address.rfind(':'));
    port->address_ = bound.empty() ? address : absl::StrCat(host, ":", bound.front());
  } catch (const std::exception&) {
    return absl::UnavailableError(
        absl::StrCat("cannot serve metrics on \"", address,
                     "\"; give HOST:PORT, for example 127.0.0.1:9464, with a port that is free"));
  }
  return port;
}

MetricsPort::~MetricsPort() = default;

}  // namespace rilievo
