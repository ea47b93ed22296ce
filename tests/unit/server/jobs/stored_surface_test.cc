#include "server/jobs/stored_surface.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <string>

#include "server/store/content_name.h"

namespace rilievo {
namespace {

constexpr uint64_t kChunks[] = {1000, 0, 300'000, 7};

v1::SurfaceHeader Header() {
  v1::SurfaceHeader header;
  for (const uint64_t bytes : kChunks) header.add_chunk_bytes(bytes);
  header.set_total_bytes(301'007);
  return header;
}

std::string Content() {
  std::string bytes(301'007, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7 + i / 251);
  return bytes;
}

FileDescriptor File() {
  FileDescriptor file(memfd_create("surface", MFD_CLOEXEC));
  EXPECT_TRUE(file.Write(Content().data(), Content().size()).ok());
  return file;
}

TEST(StoredSurface, FromEveryKindOfByteTheRestComesInOrder) {
  for (const uint64_t offset : {0, 1, 999, 1000, 1001, 132'072, 300'999, 301'000, 301'007}) {
    auto surface = StoredSurface::From(File(), ContentNameOf(Content()), Header(), offset);
    ASSERT_TRUE(surface.ok());
    v1::StreamSurfaceResponse response;
    ASSERT_TRUE(*surface->Next(&response));
    EXPECT_EQ(response.surface().total_bytes(), 301'007u);
    std::string bytes;
    while (*surface->Next(&response)) {
      const v1::SurfacePiece& piece = response.piece();
      EXPECT_EQ(piece.offset(), offset + bytes.size());
      EXPECT_LE(piece.data().size(), 131'072u);
      const int expected_chunk = piece.offset() < 1000 ? 0 : piece.offset() < 301'000 ? 2 : 3;
      EXPECT_EQ(static_cast<int>(piece.chunk()), expected_chunk);
      bytes += piece.data();
    }
    EXPECT_EQ(bytes, Content().substr(offset));
  }
  EXPECT_EQ(
      StoredSurface::From(File(), ContentNameOf(Content()), Header(), 301'008).status().code(),
      absl::StatusCode::kOutOfRange);
}

TEST(StoredSurface, AChunkIsAByte) {
  v1::StreamSurfaceRequest request;
  EXPECT_EQ(*FirstByte(request, Header()), 0u);
  request.set_chunk(2);
  EXPECT_EQ(*FirstByte(request, Header()), 1000u);
  request.set_chunk(3);
  EXPECT_EQ(*FirstByte(request, Header()), 301'000u);
  request.set_chunk(4);
  EXPECT_EQ(FirstByte(request, Header()).status().code(), absl::StatusCode::kOutOfRange);
}

TEST(StoredSurface, AnotherSizeIsDataLoss) {
  FileDescriptor file(memfd_create("surface", MFD_CLOEXEC));
  ASSERT_TRUE(file.Write("x", 1).ok());
  EXPECT_TRUE(absl::IsDataLoss(
      StoredSurface::From(std::move(file), ContentNameOf(Content()), Header(), 0).status()));
}

TEST(StoredSurface, OtherBytesAreDataLossAtTheEnd) {
  auto surface = StoredSurface::From(File(), ContentNameOf("something else"), Header(), 0);
  v1::StreamSurfaceResponse response;
  absl::StatusOr<bool> more = true;
  while (more.ok() && *more) more = surface->Next(&response);
  EXPECT_TRUE(absl::IsDataLoss(more.status()));
}

}  // namespace
}  // namespace rilievo
