#include "client/picture/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "client/picture/vertex_colors.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Latitude-longitude sphere around `center`, outward.
TriangleMesh Sphere(const Vector3d& center, double radius, int n) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, (n + 1) * 2 * n);
  mesh.triangles.resize(3, 4 * n * n);
  int face = 0;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j < 2 * n; ++j) {
      const double polar = M_PI * i / n, turn = M_PI * j / n;
      mesh.vertices.col(i * 2 * n + j) =
          center + radius * Vector3d(std::sin(polar) * std::cos(turn),
                                     std::sin(polar) * std::sin(turn), std::cos(polar));
      if (i == n) continue;
      const int a = i * 2 * n + j, b = i * 2 * n + (j + 1) % (2 * n);
      mesh.triangles.col(face++) = Eigen::Vector3i(a, a + 2 * n, b);
      mesh.triangles.col(face++) = Eigen::Vector3i(b, a + 2 * n, b + 2 * n);
    }
  }
  return mesh;
}

// A square in the plane z = `height`, facing up.
TriangleMesh Square(double height) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << -1, 1, 1, -1, -1, -1, 1, 1, height, height, height, height;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  return mesh;
}

bool IsWhite(const std::array<uint8_t, 3>& p) { return p[0] == 255 && p[1] == 255 && p[2] == 255; }

int DrawnPixels(const Image& image) {
  int drawn = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) drawn += !IsWhite(image.pixel(x, y));
  }
  return drawn;
}

PictureOptions Small() {
  PictureOptions options;
  options.width = 320;
  options.height = 240;
  return options;
}

TEST(RenderTest, OrthographicSphereCoversItsDisc) {
  PictureOptions options = Small();
  options.camera.perspective = false;
  const auto image =
      RenderPicture({Sphere(Vector3d(5, -3, 2), 0.7, 64), {}}, options, RunContext());
  ASSERT_TRUE(image.ok()) << image.status();
  // The frame leaves 4 % on either side of the shorter dimension.
  const double radius = 0.92 * 240 / 2;
  const double rim = 2 * M_PI * radius;  // pixels on the silhouette count as drawn
  EXPECT_NEAR(DrawnPixels(*image), M_PI * radius * radius + rim / 2, rim);
  EXPECT_FALSE(IsWhite(image->pixel(160, 120)));
  EXPECT_TRUE(IsWhite(image->pixel(2, 2)));
}

TEST(RenderTest, PerspectiveKeepsEverythingInTheFrame) {
  for (double elevation : {-90.0, -40.0, 0.0, 25.0, 90.0}) {
    PictureOptions options = Small();
    options.camera.elevation_degrees = elevation;
    TriangleMesh mesh = Sphere(Vector3d::Zero(), 1, 24);
    mesh.vertices.row(0) *= 7;  // a cigar
    const auto image = RenderPicture({mesh, {}}, options, RunContext());
    ASSERT_TRUE(image.ok());
    EXPECT_GT(DrawnPixels(*image), 2000) << elevation;
    for (int x = 0; x < 320; ++x) {
      EXPECT_TRUE(IsWhite(image->pixel(x, 0)) && IsWhite(image->pixel(x, 239)));
    }
    for (int y = 0; y < 240; ++y) {
      EXPECT_TRUE(IsWhite(image->pixel(0, y)) && IsWhite(image->pixel(319, y)));
    }
  }
}

TEST(RenderTest, BackFacesAreRed) {
  PictureOptions options = Small();
  options.camera.elevation_degrees = 60;
  const auto front = RenderPicture({Square(0), {}}, options, RunContext());
  options.camera.elevation_degrees = -60;
  const auto back = RenderPicture({Square(0), {}}, options, RunContext());
  const auto above = front->pixel(160, 120), below = back->pixel(160, 120);
  EXPECT_LT(above[0] - above[2], 40);
  EXPECT_GT(below[0] - below[2], 60);
}

TEST(RenderTest, TheNearerSurfaceHidesTheOther) {
  TriangleMesh mesh = Square(0);
  const TriangleMesh upper = Square(0.5);
  mesh.vertices.conservativeResize(3, 8);
  mesh.vertices.rightCols(4) = upper.vertices;
  mesh.triangles.conservativeResize(3, 4);
  mesh.triangles.rightCols(2) = upper.triangles.array() + 4;
  Scene scene{mesh, Eigen::Matrix3Xf::Zero(3, 8)};
  scene.colors.leftCols(4).row(0).setConstant(0.8f);   // lower: red
  scene.colors.rightCols(4).row(1).setConstant(0.8f);  // upper: green
  for (bool perspective : {true, false}) {
    PictureOptions options = Small();
    options.camera.perspective = perspective;
    options.camera.elevation_degrees = 90;
    const auto from_above = RenderPicture(scene, options, RunContext())->pixel(160, 120);
    EXPECT_GT(from_above[1], from_above[0] + 60);
    std::swap(scene.mesh.triangles(0, 0), scene.mesh.triangles(1, 0));  // order must not matter
    const auto again = RenderPicture(scene, options, RunContext())->pixel(160, 120);
    EXPECT_GT(again[1], again[0] + 60);
  }
}

TEST(RenderTest, LeftAndUpAreWhereTheyBelong) {
  // Turn 0, elevation 0: the camera looks along -x, so +y is right and +z is up.
  TriangleMesh mesh = Sphere(Vector3d(0, 0, 0), 1, 16);
  const TriangleMesh marker = Sphere(Vector3d(0, 3, 4), 0.5, 8);
  const int vertices = static_cast<int>(mesh.vertices.cols());
  Eigen::Matrix3Xd all(3, vertices + marker.vertices.cols());
  all << mesh.vertices, marker.vertices;
  Eigen::Matrix3Xi faces(3, mesh.triangles.cols() + marker.triangles.cols());
  faces << mesh.triangles, (marker.triangles.array() + vertices).matrix();
  PictureOptions options = Small();
  options.camera.turn_degrees = 0;
  options.camera.elevation_degrees = 0;
  options.camera.perspective = false;
  const auto image = RenderPicture({{all, faces, {}}, {}}, options, RunContext());
  int upper_right = 0, upper_left = 0, lower_left = 0;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (IsWhite(image->pixel(x, y))) continue;
      (y < 120 ? (x < 160 ? upper_left : upper_right) : lower_left) += 1;
    }
  }
  EXPECT_GT(upper_right, 500);
  EXPECT_EQ(upper_left, 0);
  EXPECT_GT(lower_left, 2000);
}

TEST(RenderTest, YUpTurnsTheScene) {
  PictureOptions options = Small();
  TriangleMesh tall = Sphere(Vector3d::Zero(), 1, 16);
  tall.vertices.row(1) *= 5;
  options.camera.up = UpAxis::kY;
  options.camera.elevation_degrees = 0;
  const auto image = RenderPicture({tall, {}}, options, RunContext());
  int highest = 240, leftmost = 320;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (IsWhite(image->pixel(x, y))) continue;
      highest = std::min(highest, y);
      leftmost = std::min(leftmost, x);
    }
  }
  EXPECT_LT(highest, 15);
  EXPECT_GT(leftmost, 120);
}

TEST(RenderTest, ThreadsDoNotChangeAPixel) {
  const Scene scene{Sphere(Vector3d::Zero(), 1, 40), {}};
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(RenderPicture(scene, Small(), one)->rgb, RenderPicture(scene, Small(), two)->rgb);
  const Scene points{{scene.mesh.vertices, {}, {}}, {}};
  EXPECT_EQ(RenderPicture(points, Small(), one)->rgb, RenderPicture(points, Small(), two)->rgb);
}

TEST(RenderTest, PointsCoverTheSphereTheyLieOn) {
  Scene scene;
  scene.mesh.vertices = Sphere(Vector3d(1e6, 2e6, 3), 2, 60).vertices;
  PictureOptions options = Small();
  options.camera.perspective = false;
  const auto image = RenderPicture(scene, options, RunContext());
  ASSERT_TRUE(image.ok());
  const double radius = 0.92 * 240 / 2;
  EXPECT_GT(DrawnPixels(*image), 0.95 * M_PI * radius * radius);
  EXPECT_LT(DrawnPixels(*image), 1.15 * M_PI * radius * radius);
}

TEST(RenderTest, OddInputIsDrawnOrRefused) {
  Scene scene{Square(0), {}};
  scene.mesh.vertices(0, 0) = std::nan("");
  EXPECT_TRUE(RenderPicture(scene, Small(), RunContext()).ok());
  scene.mesh.triangles(0, 0) = 99;
  EXPECT_EQ(RenderPicture(scene, Small(), RunContext()).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(DrawnPixels(*RenderPicture(Scene(), Small(), RunContext())), 0);
  Scene one_point;
  one_point.mesh.vertices = Vector3d(1, 2, 3);
  EXPECT_GT(DrawnPixels(*RenderPicture(one_point, Small(), RunContext())), 0);
  PictureOptions tiny;
  tiny.width = 3;
  EXPECT_FALSE(RenderPicture(scene, tiny, RunContext()).ok());
}

TEST(RenderTest, AStopIsHeard) {
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(RenderPicture({Square(0), {}}, Small(), context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(RenderTest, SheetHoldsAllViews) {
  PictureOptions options = Small();
  for (int views : {2, 3, 4}) {
    const auto sheet =
        RenderSheet({Sphere(Vector3d::Zero(), 1, 24), {}}, options, views, RunContext());
    ASSERT_TRUE(sheet.ok());
    const int columns = views == 4 ? 2 : views, rows = views == 4 ? 2 : 1;
    EXPECT_EQ(sheet->width, 320 / columns * columns);
    EXPECT_EQ(sheet->height, 240 / rows * rows);
    for (int view = 0; view < views; ++view) {
      const int x = (view % columns) * (320 / columns) + 320 / columns / 2;
      const int y = (view / columns) * (240 / rows) + 240 / rows / 2;
      EXPECT_FALSE(IsWhite(sheet->pixel(x, y))) << view;
    }
  }
  EXPECT_FALSE(RenderSheet(Scene(), options, 5, RunContext()).ok());
}

TEST(PngTest, RoundTrip) {
  Image image{5, 3, {}};
  for (int i = 0; i < 45; ++i) image.rgb.push_back(static_cast<uint8_t>(i * 5));
  const auto png = EncodePng(image);
  ASSERT_TRUE(png.ok()) << png.status();
  const auto back = DecodePng(*png);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ(back->width, 5);
  EXPECT_EQ(back->height, 3);
  EXPECT_EQ(back->rgb, image.rgb);
  EXPECT_FALSE(DecodePng(png->substr(0, png->size() / 2)).ok());
  EXPECT_FALSE(EncodePng(Image{4, 4, {}}).ok());
}

TEST(VertexColorsTest, SignsAndSourcesShow) {
  const std::vector<float> values = {-1, 0, 1, std::nanf("")};
  const Eigen::Matrix3Xf colors = ColorsByValue(values);
  EXPECT_GT(colors(2, 0), colors(0, 0) + 0.2f);  // below: blue
  EXPECT_GT(colors(0, 2), colors(2, 2) + 0.2f);  // above: red
  EXPECT_LT((colors.col(1).array() - colors.col(1).mean()).abs().maxCoeff(), 0.05f);
  EXPECT_TRUE(colors.allFinite());
  const std::vector<uint8_t> sources = {0, 1, 2, 77};
  const Eigen::Matrix3Xf by_source = ColorsBySource(sources);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < i; ++j) EXPECT_GT((by_source.col(i) - by_source.col(j)).norm(), 0.2f);
  }
  EXPECT_EQ(ColorsByValue({}).cols(), 0);
}

}  // namespace
}  // namespace rilievo
