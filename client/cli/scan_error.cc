#include "client/cli/scan_error.h"

#include "absl/strings/str_cat.h"
#include "client/cli/length_words.h"
#include "core/control/control_options.h"
#include "server/command_line/text_layout.h"

namespace rilievo {

const char* InputName(const std::string& topology) {
  return topology == TopologyName(Topology::kMesh) ? "mesh" : "scan";
}

std::string ScanErrorText(const ScanError& error) {
  const auto both = [&](double length) {
    return absl::StrCat(LengthText(length, error.place), " (", Percent(length / error.diagonal),
                        ")");
  };
  return absl::StrCat("RMS ", both(error.rms), ", 95 % below ", both(error.p95), ", max ",
                      both(error.max));
}

nlohmann::ordered_json ScanErrorJson(const ScanError& error) {
  const std::string unit = UnitName(error.place.metres_per_unit);
  return {{"rms", error.rms},
          {"p95", error.p95},
          {"max", error.max},
          {"unit", unit.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(unit)},
          {"rms_ratio", error.rms / error.diagonal},
          {"p95_ratio", error.p95 / error.diagonal},
          {"max_ratio", error.max / error.diagonal}};
}

}  // namespace rilievo
