// Metrics over HTTP.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/observability/port/scrape_server.h"

namespace prometheus {
class Collectable;
}

namespace rilievo {

// Answers GET /metrics in Prometheus' text format, to anybody who reaches the port.
class MetricsPort {
 public:
  // `address`: "HOST:PORT"; port 0 takes a free one. UNAVAILABLE when it cannot be had.
  static absl::StatusOr<std::unique_ptr<MetricsPort>> Open(
      const std::string& address, std::shared_ptr<prometheus::Collectable> metrics);

  // As bound.
  const std::string& address() const { return address_; }

 private:
  MetricsPort() = default;

  std::unique_ptr<ScrapeServer> server_;
  std::string address_;
};

}  // namespace rilievo
