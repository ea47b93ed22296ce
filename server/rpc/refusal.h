// A call that ends before anything of it was read.
#pragma once

#include "grpcpp/support/status.h"

namespace rilievo {

// A reactor of any streaming kind; owns itself.
template <typename Reactor>
class Refusal final : public Reactor {
 public:
  explicit Refusal(const grpc::Status& status) { this->Finish(status); }
  void OnDone() override { delete this; }
};

}  // namespace rilievo
