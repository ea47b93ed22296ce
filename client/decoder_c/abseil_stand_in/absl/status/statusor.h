// absl::StatusOr as far as it is used here; see status.h.
#pragma once

#include <cstdlib>
#include <optional>
#include <type_traits>
#include <utility>

#include "absl/status/status.h"

namespace absl {

template <typename T>
class [[nodiscard]] StatusOr {
 public:
  StatusOr(const Status& status) : status_(status) {}        // NOLINT: as Abseil converts
  StatusOr(Status&& status) : status_(std::move(status)) {}  // NOLINT
  template <typename U = T,
            typename = std::enable_if_t<std::is_constructible_v<T, U&&> &&
                                        !std::is_same_v<std::decay_t<U>, StatusOr> &&
                                        !std::is_same_v<std::decay_t<U>, Status>>>
  StatusOr(U&& value) : value_(std::forward<U>(value)) {}  // NOLINT

  bool ok() const { return value_.has_value(); }
  const Status& status() const& { return status_; }
  Status status() && { return std::move(status_); }

  const T& value() const& { return Checked(*this); }
  T& value() & { return Checked(*this); }
  const T& operator*() const& { return Checked(*this); }
  T& operator*() & { return Checked(*this); }
  T&& operator*() && { return std::move(Checked(*this)); }
  const T* operator->() const { return &Checked(*this); }
  T* operator->() { return &Checked(*this); }

 private:
  template <typename Self>
  static auto& Checked(Self& self) {
    if (!self.value_) std::abort();
    return *self.value_;
  }

  Status status_;
  std::optional<T> value_;
};

}  // namespace absl
