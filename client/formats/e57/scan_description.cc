#include "client/formats/e57/scan_description.h"

#include <Eigen/Geometry>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo::e57 {
namespace {

using std::string_view;

string_view Trimmed(string_view text) { return NextWord(&text); }

class DescriptionReader {
 public:
  DescriptionReader(const XmlElement& data3d, size_t number) : data3d_(data3d) {
    scan_.name = absl::StrCat("scan ", number);
  }

  absl::StatusOr<ScanDescription> Read() {
    const XmlElement* points = data3d_.Child("points");
    if (points == nullptr) return Invalid("has no element 'points'");
    RILIEVO_RETURN_IF_ERROR(CountAttribute(*points, "recordCount", &scan_.record_count));
    RILIEVO_RETURN_IF_ERROR(CountAttribute(*points, "fileOffset", &scan_.section_offset));
    if (scan_.record_count == 0) return scan_;
    const XmlElement* prototype = points->Child("prototype");
    if (prototype == nullptr) return Invalid("'points' has no element 'prototype'");
    RILIEVO_RETURN_IF_ERROR(AddFields(*prototype, ""));
    if (const XmlElement* codecs = points->Child("codecs")) {
      RILIEVO_RETURN_IF_ERROR(CheckCodecs(*codecs));
    }
    RILIEVO_RETURN_IF_ERROR(FindPlace());
    RILIEVO_RETURN_IF_ERROR(FindLayers());
    if (const XmlElement* pose = data3d_.Child("pose")) {
      RILIEVO_RETURN_IF_ERROR(ReadPose(*pose));
    }
    return scan_;
  }

 private:
  template <typename... What>
  absl::Status Invalid(const What&... what) const {
    return absl::InvalidArgumentError(absl::StrCat("E57 ", scan_.name, ": ", what...));
  }

  absl::Status CountAttribute(const XmlElement& element, const char* name, uint64_t* value) const {
    const std::string* text = element.Attribute(name);
    if (text == nullptr) return Invalid("'", element.name, "' has no attribute '", name, "'");
    if (ParseCount(Trimmed(*text), value)) return absl::OkStatus();
    return Invalid(name, " ", Quoted(*text), " is not a whole number below 2^64");
  }

  // Leaves `value` as it is where the attribute is missing.
  absl::Status NumberAttribute(const XmlElement& element, const char* name, double* value) const {
    const std::string* text = element.Attribute(name);
    if (text == nullptr) return absl::OkStatus();
    return Number(*text, absl::StrCat(name, " of ", element.name), value);
  }

  absl::Status Number(string_view text, const std::string& what, double* value) const {
    const absl::Status parsed = ParseNumber(Trimmed(text), value);
    if (!parsed.ok()) return Invalid(what, ": ", parsed.message());
    if (!std::isfinite(*value)) return Invalid(what, " is ", *value, ", which is not finite");
    return absl::OkStatus();
  }

  absl::Status IntegerAttribute(const XmlElement& element, const char* name, int64_t* value) const {
    const std::string* text = element.Attribute(name);
    if (text == nullptr) return absl::OkStatus();
    const string_view digits = Trimmed(*text);
    const char* end = digits.data() + digits.size();
    const auto [stop, error] = std::from_chars(digits.data(), end, *value);
    if (!digits.empty() && error == std::errc() && stop == end) return absl::OkStatus();
    return Invalid(name, " ", Quoted(*text), " of ", element.name,
                   " is not a whole number of 64 bits");
  }

  // The number in the child `name`; an element without text is 0.
  absl::Status ChildNumber(const XmlElement& parent, const char* name, double* value) const {
    const XmlElement* child = parent.Child(name);
    if (child == nullptr) return Invalid("'", parent.name, "' has no element '", name, "'");
    *value = 0;
    if (Trimmed(child->text).empty()) return absl::OkStatus();
    return Number(child->text, absl::StrCat(name, " of ", parent.name), value);
  }

  // Leaves of the prototype, depth first: each has a bytestream.
  absl::Status AddFields(const XmlElement& structure, const std::string& path) {
    for (const XmlElement& element : structure.children) {
      const std::string* type = element.Attribute("type");
      if (type == nullptr) return Invalid("field ", Quoted(element.name), " has no type");
      if (*type == "Structure" || *type == "Vector") {
        RILIEVO_RETURN_IF_ERROR(AddFields(element, absl::StrCat(path, element.name, "/")));
        continue;
      }
      Field field = {.name = path + element.name};
      if (*type == "Float") {
        RILIEVO_RETURN_IF_ERROR(SetFloat(element, &field));
      } else if (*type == "Integer" || *type == "ScaledInteger") {
        RILIEVO_RETURN_IF_ERROR(SetInteger(element, *type == "ScaledInteger", &field));
      } else if (*type != "String") {
        return Invalid("field ", Quoted(element.name), " is of type ", Quoted(*type),
                       ", known are Float, Integer, ScaledInteger and String");
      }
      scan_.fields.push_back(std::move(field));
    }
    return absl::OkStatus();
  }

  absl::Status SetFloat(const XmlElement& element, Field* field) const {
    const std::string* precision = element.Attribute("precision");
    const bool single = precision != nullptr && *precision == "single";
    if (precision != nullptr && !single && *precision != "double") {
      return Invalid("precision ", Quoted(*precision), " of ", element.name,
                     ", known are single and double");
    }
    field->type = single ? FieldType::kSingle : FieldType::kDouble;
    field->bits = single ? 32 : 64;
    RILIEVO_RETURN_IF_ERROR(NumberAttribute(element, "minimum", &field->least));
    return NumberAttribute(element, "maximum", &field->greatest);
  }

  absl::Status SetInteger(const XmlElement& element, bool scaled, Field* field) const {
    field->type = FieldType::kInteger;
    field->minimum = std::numeric_limits<int64_t>::min();
    int64_t maximum = std::numeric_limits<int64_t>::max();
    RILIEVO_RETURN_IF_ERROR(IntegerAttribute(element, "minimum", &field->minimum));
    RILIEVO_RETURN_IF_ERROR(IntegerAttribute(element, "maximum", &maximum));
    if (maximum < field->minimum) {
      return Invalid("maximum ", maximum, " of ", element.name, " is below its minimum ",
                     field->minimum);
    }
    // What is stored is the difference from the minimum, in as many bits as the greatest difference
    // takes.
    const uint64_t range = static_cast<uint64_t>(maximum) - static_cast<uint64_t>(field->minimum);
    field->bits = static_cast<int>(std::bit_width(range));
    if (scaled) {
      RILIEVO_RETURN_IF_ERROR(NumberAttribute(element, "scale", &field->scale));
      RILIEVO_RETURN_IF_ERROR(NumberAttribute(element, "offset", &field->offset));
      if (field->scale == 0) return Invalid("scale of ", element.name, " is 0");
    }
    field->least = static_cast<double>(field->minimum) * field->scale + field->offset;
    field->greatest = static_cast<double>(maximum) * field->scale + field->offset;
    return absl::OkStatus();
  }

  // Bit packing is what fields without a codec have, and the one codec of E57 1.0.
  absl::Status CheckCodecs(const XmlElement& codecs) const {
    for (const XmlElement& codec : codecs.children) {
      for (const XmlElement& part : codec.children) {
        if (part.name == "inputs" || part.name == "bitPackCodec") continue;
        return Invalid("codec ", Quoted(part.name),
                       ", known is bitPackCodec; export the scan without it");
      }
    }
    return absl::OkStatus();
  }

  int FieldNumber(string_view name) const {
    for (size_t i = 0; i < scan_.fields.size(); ++i) {
      if (scan_.fields[i].name == name) return static_cast<int>(i);
    }
    return -1;
  }

  // False where one of the fields is missing.
  bool FindFields(const std::array<string_view, 3>& names, std::array<int, 3>* numbers) const {
    for (size_t i = 0; i < 3; ++i) (*numbers)[i] = FieldNumber(names[i]);
    return (*numbers)[0] >= 0 && (*numbers)[1] >= 0 && (*numbers)[2] >= 0;
  }

  absl::Status FindPlace() {
    scan_.spherical = !FindFields({"cartesianX", "cartesianY", "cartesianZ"}, &scan_.place);
    if (scan_.spherical &&
        !FindFields({"sphericalRange", "sphericalAzimuth", "sphericalElevation"}, &scan_.place)) {
      std::string names;
      for (const Field& field : scan_.fields) absl::StrAppend(&names, " ", Quoted(field.name));
      return Invalid(
          "cartesianX, cartesianY, cartesianZ or sphericalRange, sphericalAzimuth, "
          "sphericalElevation are needed, its fields are",
          names, "; export it with coordinates");
    }
    scan_.invalid_state =
        FieldNumber(scan_.spherical ? "sphericalInvalidState" : "cartesianInvalidState");
    for (const int number : {scan_.place[0], scan_.place[1], scan_.place[2], scan_.invalid_state}) {
      if (number >= 0 && scan_.fields[number].type == FieldType::kUnread) {
        return Invalid(scan_.fields[number].name, " is a String; it must be a number");
      }
    }
    return absl::OkStatus();
  }

  absl::Status FindLayers() {
    const auto is_number = [&](int number) {
      return number >= 0 && scan_.fields[number].type != FieldType::kUnread;
    };
    scan_.intensity = FieldNumber("intensity");
    if (!is_number(scan_.intensity)) scan_.intensity = -1;
    scan_.classification = FieldNumber("classification");
    if (!is_number(scan_.classification)) scan_.classification = -1;
    scan_.color_invalid = FieldNumber("isColorInvalid");
    if (!is_number(scan_.color_invalid)) scan_.color_invalid = -1;
    if (!FindFields({"nor:normalX", "nor:normalY", "nor:normalZ"}, &scan_.normal) ||
        !is_number(scan_.normal[0]) || !is_number(scan_.normal[1]) || !is_number(scan_.normal[2])) {
      scan_.normal = {-1, -1, -1};
    }
    constexpr string_view kChannels[] = {"colorRed", "colorGreen", "colorBlue"};
    const XmlElement* limits = data3d_.Child("colorLimits");
    for (size_t channel = 0; channel < 3; ++channel) {
      const int number = FieldNumber(kChannels[channel]);
      if (!is_number(number)) {
        scan_.color = {-1, -1, -1};
        return absl::OkStatus();
      }
      scan_.color[channel] = number;
      auto& [darkest, brightest] = scan_.color_limits[channel];
      darkest = scan_.fields[number].least;
      brightest = scan_.fields[number].greatest;
      const std::string name(kChannels[channel]);
      for (const auto& [child, limit] :
           {std::pair(name + "Minimum", &darkest), std::pair(name + "Maximum", &brightest)}) {
        if (limits == nullptr || limits->Child(child) == nullptr) continue;
        RILIEVO_RETURN_IF_ERROR(ChildNumber(*limits, child.c_str(), limit));
      }
    }
    return absl::OkStatus();
  }

  // A unit quaternion and a translation, either of which may be missing.
  absl::Status ReadPose(const XmlElement& pose) {
    scan_.has_pose = true;
    if (const XmlElement* rotation = pose.Child("rotation")) {
      Eigen::Quaterniond turn;
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*rotation, "w", &turn.w()));
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*rotation, "x", &turn.x()));
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*rotation, "y", &turn.y()));
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*rotation, "z", &turn.z()));
      const double length = turn.norm();
      // Writers round; a quaternion that is further off is not a rotation.
      if (!(std::abs(length - 1) < 1e-3)) {
        return Invalid("the quaternion of its pose has the length ", length,
                       ", it must be 1; export the scan with the pose as a unit quaternion");
      }
      scan_.rotation = turn.normalized().toRotationMatrix();
    }
    if (const XmlElement* translation = pose.Child("translation")) {
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*translation, "x", &scan_.translation.x()));
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*translation, "y", &scan_.translation.y()));
      RILIEVO_RETURN_IF_ERROR(ChildNumber(*translation, "z", &scan_.translation.z()));
    }
    return absl::OkStatus();
  }

  const XmlElement& data3d_;
  ScanDescription scan_;
};

}  // namespace

absl::StatusOr<std::vector<ScanDescription>> DescribeScans(const XmlElement& root) {
  if (root.name != "e57Root") {
    return absl::InvalidArgumentError(absl::StrCat("E57: the root of the XML section is ",
                                                   Quoted(root.name), ", it must be e57Root"));
  }
  std::vector<ScanDescription> scans;
  const XmlElement* data3d = root.Child("data3D");
  if (data3d == nullptr) return scans;
  for (const XmlElement& element : data3d->children) {
    RILIEVO_ASSIGN_OR_RETURN(ScanDescription scan,
                             DescriptionReader(element, scans.size() + 1).Read());
    scans.push_back(std::move(scan));
  }
  return scans;
}

}  // namespace rilievo::e57
