#include "client/library/surface_assembly.h"

#include <gtest/gtest.h>

#include <utility>

namespace rilievo {
namespace {

v1::SurfaceHeader Header(const std::vector<uint64_t>& chunks, uint64_t total) {
  v1::SurfaceHeader header;
  header.set_total_bytes(total);
  for (const uint64_t bytes : chunks) header.add_chunk_bytes(bytes);
  return header;
}

v1::SurfacePiece Piece(uint32_t chunk, uint64_t offset, const std::string& data) {
  v1::SurfacePiece piece;
  piece.set_chunk(chunk);
  piece.set_offset(offset);
  piece.set_data(data);
  return piece;
}

TEST(SurfaceAssembly, PutsPiecesTogether) {
  SurfaceAssembly assembly;
  ASSERT_TRUE(assembly.Begin(Header({3, 0, 4}, 7)).ok());
  ASSERT_TRUE(assembly.Append(Piece(0, 0, "ab")).ok());
  ASSERT_TRUE(assembly.Append(Piece(0, 2, "c")).ok());
  ASSERT_TRUE(assembly.Append(Piece(2, 3, "defg")).ok());
  EXPECT_EQ(assembly.chunk_bytes(), (std::vector<int64_t>{3, 0, 4}));
  const auto bytes = std::move(assembly).Finish();
  ASSERT_TRUE(bytes.ok());
  EXPECT_EQ(std::string(bytes->begin(), bytes->end()), "abcdefg");
}

TEST(SurfaceAssembly, RefusesHeadersThatDoNotAddUp) {
  const uint64_t huge = ~uint64_t{0};
  for (const auto& header : {Header({3, 4}, 8), Header({3, 4}, 6), Header({huge, 8}, 7),
                             Header({7, huge, 1}, 7), Header({}, 1)}) {
    SurfaceAssembly assembly;
    EXPECT_EQ(assembly.Begin(header).code(), absl::StatusCode::kDataLoss);
  }
}

TEST(SurfaceAssembly, RefusesPiecesOutOfPlace) {
  const auto code = [](const std::vector<v1::SurfacePiece>& pieces) {
    SurfaceAssembly assembly;
    EXPECT_TRUE(assembly.Begin(Header({3, 4}, 7)).ok());
    for (const auto& piece : pieces) {
      if (const absl::Status status = assembly.Append(piece); !status.ok()) return status.code();
    }
    return std::move(assembly).Finish().status().code();
  };
  EXPECT_EQ(code({Piece(0, 0, "abc"), Piece(1, 3, "defg")}), absl::StatusCode::kOk);
  EXPECT_EQ(code({Piece(0, 0, "abc")}), absl::StatusCode::kDataLoss) << "too short";
  EXPECT_EQ(code({Piece(0, 1, "abc")}), absl::StatusCode::kDataLoss) << "gap";
  EXPECT_EQ(code({Piece(0, 0, "abcd")}), absl::StatusCode::kDataLoss) << "over the chunk's end";
  EXPECT_EQ(code({Piece(0, 0, "abc"), Piece(0, 3, "d")}), absl::StatusCode::kDataLoss);
  EXPECT_EQ(code({Piece(1, 0, "abc"), Piece(0, 3, "d")}), absl::StatusCode::kDataLoss);
  EXPECT_EQ(code({Piece(2, 0, "abc")}), absl::StatusCode::kDataLoss) << "no such chunk";
  SurfaceAssembly headless;
  EXPECT_EQ(headless.Append(Piece(0, 0, "a")).code(), absl::StatusCode::kDataLoss);
  EXPECT_EQ(std::move(headless).Finish().status().code(), absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace rilievo
