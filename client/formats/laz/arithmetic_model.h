// Adaptive frequencies of symbols and bits, as the arithmetic coder of LASzip counts them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace rilievo::laz {

// Frequencies of 2 to 1024 symbols, each 1 at first; the distribution follows the counts at
// intervals that grow. After A. Said, "Introduction to Arithmetic Coding Theory and Practice", HP
// Labs report HPL-2004-76, section 2.2 ("static and adaptive models"), with the constants of
// LASzip.
class SymbolModel {
 public:
  // Cumulative frequencies are scaled to this many bits.
  static constexpr int kBits = 15;

  explicit SymbolModel(uint32_t symbols);

  // The symbol within whose share `cumulative` lies; beyond 2^kBits the last one.
  uint32_t Find(uint32_t cumulative) const {
    const Share* shares = shares_.data();
    uint32_t symbol = first_[cumulative >> bucket_shift_];
    while (shares[symbol + 1].lower <= cumulative) ++symbol;
    return symbol;
  }
  // Cumulative frequency below `symbol`.
  uint32_t lower(uint32_t symbol) const { return shares_[symbol].lower; }
  uint32_t last_symbol() const { return last_symbol_; }

  void Count(uint32_t symbol) {
    ++shares_[symbol].count;
    if (--until_update_ == 0) Update();
  }

 private:
  // Side by side, since a symbol that is found is counted: of most models nothing else is in the
  // fastest cache when it is needed.
  struct Share {
    uint16_t lower;  // cumulative frequency below the symbol, scaled
    uint16_t count;  // at most 2^kBits together
  };

  void Update();

  uint32_t last_symbol_;
  int bucket_shift_;
  uint32_t total_ = 0, interval_, until_update_ = 0;
  std::vector<Share> shares_;    // and behind the last symbol a lower end that none reaches
  std::vector<uint16_t> first_;  // by bucket of cumulative frequencies: the symbol at its start
};

// The same for bits.
class BitModel {
 public:
  static constexpr int kBits = 13;

  // Share of zeros, scaled to kBits bits: 1 to 2^kBits - 1.
  uint32_t zeros() const { return zeros_; }

  void Count(uint32_t bit) {
    if (bit == 0) ++zero_count_;
    if (--until_update_ == 0) Update();
  }

 private:
  void Update();

  uint32_t zeros_ = 1u << (kBits - 1);
  uint32_t zero_count_ = 1, count_ = 2, interval_ = 4, until_update_ = 4;
};

// A model for each of some contexts, made when its context first occurs.
class ContextModels {
 public:
  ContextModels(size_t contexts, uint32_t symbols) : symbols_(symbols), models_(contexts) {}

  SymbolModel& operator[](uint32_t context) {
    std::optional<SymbolModel>& model = models_[context];
    if (!model) model.emplace(symbols_);
    return *model;
  }

 private:
  uint32_t symbols_;
  std::vector<std::optional<SymbolModel>> models_;
};

}  // namespace rilievo::laz
