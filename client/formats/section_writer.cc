#include "client/formats/section_writer.h"

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/block_writer.h"
#include "client/formats/file_kind.h"
#include "client/formats/number_text.h"

namespace rilievo {
namespace {

void AppendPair(const Eigen::Vector2d& point, std::string& text) {
  AppendNumber(point.x(), &text);
  text += ' ';
  AppendNumber(point.y(), &text);
}

// Points in the axes of the plane, y downward as pictures have it.
std::vector<Eigen::Matrix2Xd> Drawn(const PlaneSection& section) {
  const PlaneAxes axes = AxesOf(section.plane);
  std::vector<Eigen::Matrix2Xd> drawn;
  for (const SectionPolyline& polyline : section.polylines) {
    Eigen::Matrix2Xd points(2, polyline.points.cols());
    points.row(0) = axes.right.transpose() * polyline.points;
    points.row(1) = -axes.up.transpose() * polyline.points;
    drawn.push_back(std::move(points));
  }
  return drawn;
}

std::string Description(const PlaneSection& section, const Eigen::Vector2d& corner) {
  const PlaneAxes axes = AxesOf(section.plane);
  const Eigen::Vector3d& normal = section.plane.normal;
  const Eigen::Vector3d place =
      section.plane.offset * normal + corner.x() * axes.right - corner.y() * axes.up;
  std::string text;
  const auto add = [&](const char* before, const Eigen::Vector3d& vector) {
    text += before;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) text += ' ';
      AppendNumber(vector[axis], &text);
    }
  };
  add("Section with the plane of normal ", normal);
  text += " and offset ";
  AppendNumber(section.plane.offset, &text);
  add("; the origin of the picture is at ", place);
  add(", its right is ", axes.right);
  add(", its top is ", axes.up);
  return text;
}

}  // namespace

absl::Status WriteObjSections(std::span<const PlaneSection> sections, std::ostream& out) {
  BlockWriter writer(out);
  int64_t before = 0, number = 0;
  for (const PlaneSection& section : sections) {
    absl::StrAppend(&writer.text(), "o section_", ++number, "\n");
    for (const SectionPolyline& polyline : section.polylines) {
      for (Eigen::Index i = 0; i < polyline.points.cols(); ++i) {
        std::string& text = writer.text();
        text += 'v';
        for (int axis = 0; axis < 3; ++axis) {
          text += ' ';
          AppendNumber(polyline.points(axis, i), &text);
        }
        text += '\n';
      }
      writer.text() += 'l';
      for (Eigen::Index i = 0; i < polyline.points.cols(); ++i) {
        absl::StrAppend(&writer.text(), " ", before + i + 1);
      }
      if (polyline.closed) absl::StrAppend(&writer.text(), " ", before + 1);
      writer.text() += '\n';
      before += polyline.points.cols();
    }
  }
  return absl::OkStatus();
}

absl::Status WriteDxfSections(std::span<const PlaneSection> sections, std::ostream& out) {
  constexpr int kClosed = 1, kSpatial = 8, kSpatialVertex = 32;  // group code 70
  BlockWriter writer(out);
  writer.text() +=
      "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  int64_t number = 0;
  for (const PlaneSection& section : sections) {
    const std::string layer = absl::StrCat("8\nsection_", ++number, "\n");
    for (const SectionPolyline& polyline : section.polylines) {
      absl::StrAppend(&writer.text(), "0\nPOLYLINE\n", layer, "66\n1\n70\n",
                      kSpatial + (polyline.closed ? kClosed : 0), "\n10\n0.0\n20\n0.0\n30\n0.0\n");
      for (Eigen::Index i = 0; i < polyline.points.cols(); ++i) {
        std::string& text = writer.text();
        absl::StrAppend(&text, "0\nVERTEX\n", layer);
        for (int axis = 0; axis < 3; ++axis) {
          absl::StrAppend(&text, 10 * (axis + 1), "\n");
          AppendNumber(polyline.points(axis, i), &text);
          text += '\n';
        }
        absl::StrAppend(&text, "70\n", kSpatialVertex, "\n");
      }
      absl::StrAppend(&writer.text(), "0\nSEQEND\n", layer);
    }
  }
  writer.text() += "0\nENDSEC\n0\nEOF\n";
  return absl::OkStatus();
}

absl::Status WriteSvgSection(std::span<const PlaneSection> sections, std::ostream& out) {
  if (sections.size() != 1) {
    return absl::InvalidArgumentError(absl::StrCat(
        "an .svg holds one section, not ", sections.size(), "; write .obj or .dxf for several"));
  }
  const PlaneSection& section = sections[0];
  if (section.polylines.empty()) {
    return absl::InvalidArgumentError(
        "the plane does not meet the shape; there is nothing to draw");
  }
  const std::vector<Eigen::Matrix2Xd> drawn = Drawn(section);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector2d low(kInfinity, kInfinity), high = -low;
  for (const Eigen::Matrix2Xd& points : drawn) {
    low = low.cwiseMin(points.rowwise().minCoeff());
    high = high.cwiseMax(points.rowwise().maxCoeff());
  }
  BlockWriter writer(out);
  writer.text() += "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ";
  AppendPair(high - low, writer.text());
  absl::StrAppend(&writer.text(), "\">\n<desc>", Description(section, low), "</desc>\n");
  writer.text() +=
      "<g stroke=\"black\" stroke-width=\"1\" fill-rule=\"evenodd\" fill=\"lightgray\">\n"
      "<path vector-effect=\"non-scaling-stroke\" d=\"";
  // One path, so that holes are holes; open polylines are not filled.
  const auto draw = [&](bool closed) {
    for (size_t k = 0; k < drawn.size(); ++k) {
      if (section.polylines[k].closed != closed) continue;
      for (Eigen::Index i = 0; i < drawn[k].cols(); ++i) {
        std::string& text = writer.text();
        text += i == 0 ? 'M' : 'L';
        AppendPair(drawn[k].col(i) - low, text);
      }
      writer.text() += closed ? "Z\n" : "\n";
    }
  };
  draw(true);
  writer.text() += "\"/>\n<path vector-effect=\"non-scaling-stroke\" fill=\"none\" d=\"";
  draw(false);
  writer.text() += "\"/>\n</g>\n</svg>\n";
  return absl::OkStatus();
}

absl::Status WriteSections(const std::string& path, std::span<const PlaneSection> sections) {
  const std::string extension = Extension(path);
  const auto write = extension == "obj"   ? WriteObjSections
                     : extension == "dxf" ? WriteDxfSections
                     : extension == "svg" ? WriteSvgSection
                                          : nullptr;
  if (write == nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": the extension must be .obj, .dxf or .svg"));
  }
  return WriteFileAtomically(path, [&](std::ostream& out) { return write(sections, out); });
}

}  // namespace rilievo
