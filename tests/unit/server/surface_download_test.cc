#include "server/surface_download.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

EncodedSurface MakeEncoded(const std::vector<size_t>& sizes) {
  EncodedSurface encoded;
  uint32_t state = 1;
  for (const size_t size : sizes) {
    std::vector<uint8_t> chunk(size);
    for (uint8_t& byte : chunk) byte = static_cast<uint8_t>((state = state * 1664525 + 1) >> 24);
    encoded.chunks.push_back(std::move(chunk));
  }
  return encoded;
}

TEST(SurfaceDownload, HandsOutHeaderPiecesAndSummaryInOrder) {
  const std::vector<size_t> sizes = {100, kPieceBytes, 0, 2 * kPieceBytes + 1, 7};
  const EncodedSurface encoded = MakeEncoded(sizes);
  v1::ReconstructReport report;
  report.set_genus(3);
  SurfaceDownload download(encoded, report);
  v1::ReconstructResponse response;

  ASSERT_TRUE(download.Next(&response));
  ASSERT_TRUE(response.has_surface());
  EXPECT_EQ(response.surface().total_bytes(), 3 * kPieceBytes + 108);
  ASSERT_EQ(response.surface().chunk_bytes_size(), 5);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(response.surface().chunk_bytes(i), sizes[static_cast<size_t>(i)]);
  }

  std::vector<std::vector<uint8_t>> received(sizes.size());
  uint64_t offset = 0;
  std::vector<uint32_t> chunks;
  while (download.Next(&response) && response.has_piece()) {
    const v1::SurfacePiece& piece = response.piece();
    EXPECT_EQ(piece.offset(), offset);
    EXPECT_GT(piece.data().size(), 0u);
    EXPECT_LE(piece.data().size(), kPieceBytes);
    ASSERT_LT(piece.chunk(), received.size());
    offset += piece.data().size();
    chunks.push_back(piece.chunk());
    received[piece.chunk()].insert(received[piece.chunk()].end(), piece.data().begin(),
                                   piece.data().end());
  }
  EXPECT_EQ(received, encoded.chunks);
  EXPECT_EQ(chunks, (std::vector<uint32_t>{0, 1, 3, 3, 3, 4}));

  ASSERT_TRUE(response.has_summary());
  EXPECT_EQ(response.summary().report().genus(), 3);
  EXPECT_FALSE(download.Next(&response));
  EXPECT_FALSE(download.Next(&response));
}

}  // namespace
}  // namespace rilievo
