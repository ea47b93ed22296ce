#include "client/cli/export_place.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/exit_code.h"
#include "client/cli/length_words.h"
#include "client/cli/loaded_shape.h"
#include "client/formats/export_axes.h"
#include "client/formats/mesh_writer.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

constexpr double kFineRounding = 1e-6;  // of the diagonal
// The length of three coordinates of which each moves by half a unit of its 13th digit.
constexpr double kStepRounding = 5e-13 * std::numbers::sqrt3;

}  // namespace

void AddExportPlace(CLI::App* app, ExportPlaceArguments* arguments) {
  AddUnitAndUp(app, &arguments->place);
  app->add_option("--origin", arguments->origin,
                  "the point X,Y,Z of the scan's coordinates that becomes 0,0,0 in the file, or "
                  "auto: a round one near the middle; for programs that keep few digits");
}

absl::Status CheckExportPlace(const ExportPlaceArguments& arguments, const std::string& output,
                              const std::string& extension) {
  const bool has_none =
      extension == "ply" || extension == "obj" || extension == "stl" || extension == "png";
  if (has_none && !arguments.place.up.empty()) {
    return UsageError(absl::StrCat(output, ": .", extension,
                                   " has no way up; leave --up out, or write .glb, .3mf or .usda"));
  }
  if (extension == "png" && !arguments.origin.empty()) {
    return UsageError(absl::StrCat(output, ": .png holds heights alone; leave --origin out"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Eigen::Vector3d> OriginOf(const ExportPlaceArguments& arguments,
                                         const SpatialFrame& frame) {
  if (arguments.origin.empty()) return Eigen::Vector3d::Zero();
  if (arguments.origin == "auto") return RoundOrigin(frame.center, frame.diagonal);
  const std::vector<std::string> words = absl::StrSplit(arguments.origin, ',');
  Eigen::Vector3d origin;
  bool good = words.size() == 3;
  for (int axis = 0; good && axis < 3; ++axis) {
    good = absl::SimpleAtod(words[static_cast<size_t>(axis)], &origin[axis]) &&
           std::isfinite(origin[axis]);
  }
  if (good) return origin;
  return UsageError(absl::StrCat("--origin ", arguments.origin,
                                 ": write three numbers, such as 4500000,5500000,0, or auto"));
}

std::string RoundingWarning(const std::string& extension, const Eigen::Matrix3Xd& vertices,
                            const ScanPlace& place) {
  const bool step = extension == "step";
  if (!step && extension != "stl" && extension != "3mf") return "";
  const double diagonal = DiagonalOf(vertices);
  const double rounding =
      step ? kStepRounding * vertices.cwiseAbs().maxCoeff() : FloatRounding(vertices);
  if (!(rounding > kFineRounding * diagonal)) return "";
  return absl::StrCat(absl::AsciiStrToUpper(extension), " keeps ", step ? "13" : "seven",
                      " digits of a coordinate: vertices move by up to ",
                      LengthText(rounding, place), " (", Percent(rounding / diagonal),
                      " of the diagonal); rilievo export --origin auto avoids that");
}

}  // namespace rilievo
