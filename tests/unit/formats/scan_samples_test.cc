#include "tests/unit/formats/scan_samples.h"

#include <cmath>
#include <sstream>

#include "client/formats/lzf.h"
#include "client/formats/number_text.h"
#include "tests/unit/formats/e57_file.h"

namespace rilievo::testing {
namespace {

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
  return text;
}

std::string PlyWithLists(const Eigen::Matrix3Xd& points) {
  std::string bytes = PlyHeaderText(
      "binary_little_endian", std::to_string(points.cols()),
      "property float x\nproperty float y\nproperty float z\nproperty list uchar uint neigh\n"
      "property float conf\n");
  for (int i = 0; i < points.cols(); ++i) {
    bytes += FloatRows(points.col(i)) + Raw(static_cast<uint8_t>(i % 4));
    for (int k = 0; k < i % 4; ++k) bytes += Raw(static_cast<uint32_t>(k));
    bytes += Raw(1.0f);
  }
  return bytes;
}

// An element with lists before the vertices, mixed types in odd order, another element after.
std::string PlyMixed(const Eigen::Matrix3Xd& points, bool big) {
  std::string bytes = "ply\nformat ";
  bytes += big ? "binary_big_endian 1.0\n" : "binary_little_endian 1.0\n";
  bytes +=
      "comment odd\nobj_info num_cols 4\nelement camera 2\nproperty float fov\n"
      "property list int16 double pose\nelement vertex " +
      std::to_string(points.cols()) +
      "\nproperty uchar flag\nproperty double z\nproperty float x\nproperty int64 time\n"
      "property float y\nproperty ushort red\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (int camera = 0; camera < 2; ++camera) {
    bytes += Raw(45.f, big) + Raw(static_cast<int16_t>(2), big) + Raw(1.5, big) + Raw(2.5, big);
  }
  for (int i = 0; i < points.cols(); ++i) {
    bytes += Raw(uint8_t{7}) + Raw(points(2, i), big) + Raw(static_cast<float>(points(0, i)), big) +
             Raw(int64_t{-5}, big) + Raw(static_cast<float>(points(1, i)), big) +
             Raw(uint16_t{65000}, big);
  }
  return bytes + Raw(uint8_t{3}) + Raw(0, big) + Raw(1, big) + Raw(2, big);
}

std::string E57OfFloats(const Eigen::Matrix3Xd& points) {
  E57Scan scan = {.records = static_cast<uint64_t>(points.cols())};
  const char* const names[] = {"cartesianX", "cartesianY", "cartesianZ"};
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values(static_cast<size_t>(points.cols()));
    Eigen::VectorXd::Map(values.data(), points.cols()) = points.row(axis);
    scan.columns.push_back(E57Reals(names[axis], true, values));
  }
  return E57File({scan});
}

std::string PlyAsciiMixed(const Eigen::Matrix3Xd& points) {
  std::string bytes =
      "ply\nformat ascii 1.0\nelement face 2\n"
      "property list uchar int vertex_indices\nelement vertex " +
      std::to_string(points.cols()) +
      "\nproperty list uchar int seen\nproperty double y\nproperty int id\n"
      "property double x\nproperty double z\nend_header\n3 0 1 2\n4 0 2 1 0\n";
  for (int i = 0; i < points.cols(); ++i) {
    bytes += i % 2 ? "\t2 9 8 " : "0  ";
    AppendNumber(points(1, i), &bytes);
    bytes += " -7 +";
    AppendNumber(std::abs(points(0, i)), &bytes);
    bytes += ' ';
    AppendNumber(points(2, i), &bytes);
    bytes += i % 3 ? " \n\n" : "\r\n";
  }
  return bytes;
}

std::string PcdHeader(int points, const std::string& data, const std::string& layout) {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" + layout + "WIDTH " +
         std::to_string(points) + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(points) + "\nDATA " + data + "\n";
}

const char* kMixedLayout =
    "FIELDS rgb z _ x label y\nSIZE 4 8 1 4 2 4\nTYPE U F U F I F\nCOUNT 1 1 3 1 2 1\n";

std::string PcdBinary(const Eigen::Matrix3Xd& points) {
  std::string bytes = PcdHeader(static_cast<int>(points.cols()), "binary", kMixedLayout);
  for (int i = 0; i < points.cols(); ++i) {
    bytes += Raw(0xff00ffu) + Raw(points(2, i)) + "pad" + Raw(static_cast<float>(points(0, i))) +
             Raw(int16_t{1}) + Raw(int16_t{2}) + Raw(static_cast<float>(points(1, i)));
  }
  return bytes;
}

std::string PcdCompressed(const Eigen::Matrix3Xd& points) {
  std::string planes[6];
  for (int i = 0; i < points.cols(); ++i) {
    planes[0] += Raw(0xff00ffu);
    planes[1] += Raw(points(2, i));
    planes[2] += "pad";
    planes[3] += Raw(static_cast<float>(points(0, i)));
    planes[4] += Raw(int16_t{1}) + Raw(int16_t{2});
    planes[5] += Raw(static_cast<float>(points(1, i)));
  }
  std::string body;
  for (const std::string& plane : planes) body += plane;
  const std::vector<char> packed = EncodeLzf(body);
  return PcdHeader(static_cast<int>(points.cols()), "binary_compressed", kMixedLayout) +
         Raw(static_cast<uint32_t>(packed.size())) + Raw(static_cast<uint32_t>(body.size())) +
         std::string(packed.begin(), packed.end());
}

std::string PcdAscii(const Eigen::Matrix3Xd& points) {
  std::string bytes = PcdHeader(static_cast<int>(points.cols()), "ascii",
                                "FIELDS x y z n\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 2\n");
  for (int i = 0; i < points.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      AppendNumber(points(axis, i), &bytes);
      bytes += ' ';
    }
    bytes += "nan 0\n";
  }
  return bytes;
}

std::string Obj(const Eigen::Matrix3Xd& points) {
  std::string bytes = "# made\nmtllib a.mtl\no thing\n";
  std::string rows = TextRows(points);
  bytes += "v " + Replaced(rows.substr(0, rows.size() - 1), "\n", "\nv ") + "\n";
  return bytes + "vn 0 0 1\nf 1//1 2//1 3//1\nl 1 2\n";
}

}  // namespace

Eigen::Matrix3Xd SpherePoints(int count) {
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i) {
    const double z = 1 - 2 * (i + 0.5) / count, ring = std::sqrt(1 - z * z), turn = 2.4 * i;
    // x is kept positive so that the text variants can show a plus sign.
    points.col(i) << std::abs(ring * std::cos(turn)), ring * std::sin(turn), z;
  }
  // Multiples of 2^-20: float holds them exactly.
  return (points * 0x1p20).array().round() * 0x1p-20;
}

std::string PlyHeaderText(const std::string& format, const std::string& vertex_count,
                          const std::string& properties) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + vertex_count + "\n" + properties +
         "end_header\n";
}

std::string FloatRows(const Eigen::Matrix3Xd& points, bool big_endian) {
  std::string bytes;
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    bytes += Raw(static_cast<float>(points.data()[i]), big_endian);
  }
  return bytes;
}

std::string TextRows(const Eigen::Matrix3Xd& points, const std::string& separator,
                     const std::string& line_end) {
  std::string bytes;
  for (int i = 0; i < points.cols(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      AppendNumber(points(axis, i), &bytes);
      bytes += axis < 2 ? separator : line_end;
    }
  }
  return bytes;
}

absl::StatusOr<ScanFile> ReadBytes(const std::string& bytes, const std::string& name) {
  std::istringstream in(bytes);
  return ReadScanStream(in, name);
}

std::vector<NamedBytes> ValidScans(int count) {
  const Eigen::Matrix3Xd points = SpherePoints(count);
  const std::string n = std::to_string(count), rows = FloatRows(points);
  const std::string ply = PlyHeaderText("binary_little_endian", n);
  const std::string ascii = PlyHeaderText("ascii", n) + TextRows(points);
  return {
      {"little.ply", ply + rows, count},
      {"big.ply", PlyHeaderText("binary_big_endian", n) + FloatRows(points, true), count},
      {"ascii.ply", ascii, count},
      {"ascii_crlf.ply", Replaced(ascii, "\n", "\r\n"), count},
      {"crlf_header.ply", Replaced(ply, "\n", "\r\n") + rows, count},
      {"long_comment.ply",
       Replaced(ply, "element", "comment " + std::string(65536, 'c') + "\nelement") + rows, count},
      {"lists.ply", PlyWithLists(points), count},
      {"mixed_little.ply", PlyMixed(points, false), count},
      {"mixed_big.ply", PlyMixed(points, true), count},
      {"mixed_ascii.ply", PlyAsciiMixed(points), count},
      {"ascii.pcd", PcdAscii(points), count},
      {"binary.pcd", PcdBinary(points), count},
      {"compressed.pcd", PcdCompressed(points), count},
      {"plain.xyz", TextRows(points), count},
      {"tabs.txt", "# x y z\n" + TextRows(points, "\t", " 255 0 0\r\n"), count},
      {"commas.csv", "x,y,z,label\n" + TextRows(points, ",", ",a b\n"), count},
      {"spaced_commas.txt", "// points\n\n" + TextRows(points, ", "), count},
      {"semicolons.asc", TextRows(points, ";"), count},
      {"counted.pts", n + "\n" + TextRows(points, " ", " -1203 90 91 92\n"), count},
      {"unnamed", TextRows(points), count},
      {"lines.obj", Obj(points), count},
      {"format_0.las", LasFile(points, {}), count},
      {"extra_bytes.las", LasFile(points, {.minor = 3, .point_format = 3, .extra = 5}), count},
      {"format_7.las", LasFile(points, {.minor = 4, .point_format = 7}), count},
      {"las_unnamed", LasFile(points, {.minor = 4, .point_format = 10}), count},
      {"floats.e57", E57OfFloats(points), count},
      {"e57_unnamed", E57OfFloats(points), count},
      {"grid.ptx", PtxCloud(1, count, kIdentity, TextRows(points, " ", " 0.5\n")), count},
      {"ptx_unnamed", PtxCloud(count, 1, kIdentity, TextRows(points, " ", " 0.5 9 8 7\r\n")),
       count},
  };
}

}  // namespace rilievo::testing
