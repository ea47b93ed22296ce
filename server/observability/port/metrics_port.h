// Metrics over HTTP.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace prometheus {
class Collectable;
class Exposer;
}  // namespace prometheus

namespace rilievo {

// Answers GET /metrics in Prometheus' text format, to anybody who reaches the port.
class MetricsPort {
 public:
  // `address`: "HOST:PORT", HOST a number; port 0 takes a free one. UNAVAILABLE when it cannot be
  // had.
  static absl::StatusOr<std::unique_ptr<MetricsPort>> Open(
      const std::string& address, std::shared_ptr<prometheus::Collectable> metrics);
  ~MetricsPort();

  // As bound.
  const std::string& address() const { return address_; }

 private:
  MetricsPort() = default;

  std::shared_ptr<prometheus::Collectable> metrics_;
  std::unique_ptr<prometheus::Exposer> exposer_;
  std::string address_;
};

}  // namespace rilievo
