// Sparse rows of weights of control vertices, and sums of them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace rilievo {

// Entries of most rows, for reserving: a regular patch has 12 control vertices.
inline constexpr int kEntriesPerRow = 12;

template <typename T>
void AppendAll(const std::vector<T>& more, std::vector<T>& all) {
  all.insert(all.end(), more.begin(), more.end());
}

inline void AppendBegins(const std::vector<int>& more, std::vector<int>& begin) {
  const int offset = begin.back();
  for (size_t r = 1; r < more.size(); ++r) begin.push_back(offset + more[r]);
}

// Sparse rows of `Width` weights an entry; column = entry, ascending control vertices within a row.
template <int Width>
struct SparseRows {
  std::vector<int> begin = {0};
  std::vector<int> control_vertices;
  std::vector<std::array<double, Width>> weights;

  void Reserve(int rows) {
    begin.reserve(rows + 1);
    control_vertices.reserve(rows * kEntriesPerRow);
    weights.reserve(rows * kEntriesPerRow);
  }
  void Push(int control_vertex, const std::array<double, Width>& weight) {
    control_vertices.push_back(control_vertex);
    weights.push_back(weight);
  }
  void EndRow() { begin.push_back(static_cast<int>(control_vertices.size())); }
  void Append(const SparseRows& rows) {
    AppendBegins(rows.begin, begin);
    AppendAll(rows.control_vertices, control_vertices);
    AppendAll(rows.weights, weights);
  }
};

// Sums of sparse rows: a dense row of control vertices that remembers which of them it holds.
template <int Width>
class RowAccumulator {
 public:
  explicit RowAccumulator(int control_vertex_count)
      : held_(control_vertex_count, 0), weights_(control_vertex_count) {}

  void Add(int control_vertex, double weight, const std::array<double, Width>& factors) {
    std::array<double, Width>& sum = weights_[control_vertex];
    if (!held_[control_vertex]) {
      held_[control_vertex] = 1;
      touched_.push_back(control_vertex);
      sum.fill(0.0);
    }
    for (int i = 0; i < Width; ++i) sum[i] += weight * factors[i];
  }

  template <int RowWidth>
  void AddRow(const SparseRows<RowWidth>& rows, int row, const std::array<double, Width>& factors) {
    for (int i = rows.begin[row]; i < rows.begin[row + 1]; ++i) {
      if (rows.weights[i][0] == 0.0) continue;  // there for the ring sum only
      Add(rows.control_vertices[i], rows.weights[i][0], factors);
    }
  }

  // Calls emit(control_vertex, sums) in ascending order, and empties the row.
  template <typename Emit>
  void Flush(const Emit& emit) {
    std::sort(touched_.begin(), touched_.end());
    for (int control_vertex : touched_) {
      held_[control_vertex] = 0;
      emit(control_vertex, weights_[control_vertex]);
    }
    touched_.clear();
  }

 private:
  std::vector<uint8_t> held_;
  std::vector<std::array<double, Width>> weights_;
  std::vector<int> touched_;
};

}  // namespace rilievo
