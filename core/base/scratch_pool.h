// Working memory lent to one block of parallel work at a time.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

namespace rilievo {

// Copies of a prototype, made when all others are lent; no more than blocks run at the same time.
// What a block leaves in one must not change what the next finds.
template <typename Scratch>
class ScratchPool {
 public:
  // Keeps the reference.
  explicit ScratchPool(const Scratch& prototype) : prototype_(prototype) {}
  explicit ScratchPool(Scratch&& prototype) = delete;

  struct Return {
    ScratchPool* pool;
    void operator()(Scratch* scratch) const {
      const std::lock_guard lock(pool->mutex_);
      pool->idle_.emplace_back(scratch);
    }
  };
  using Loan = std::unique_ptr<Scratch, Return>;

  // For one thread, until the loan ends. The pool outlives its loans.
  Loan Take() {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        Scratch* const scratch = idle_.back().release();
        idle_.pop_back();
        return Loan(scratch, Return{this});
      }
    }
    return Loan(new Scratch(prototype_), Return{this});
  }

 private:
  const Scratch& prototype_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Scratch>> idle_;
};

}  // namespace rilievo
