#include "client/cli/measure_words.h"

#include <cmath>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client/cli/exit_code.h"

namespace rilievo {
std::optional<Eigen::VectorXd> ReadNumbers(absl::string_view word, int count) {
  const std::vector<std::string> parts = absl::StrSplit(word, ',');
  if (static_cast<int>(parts.size()) != count) return std::nullopt;
  Eigen::VectorXd numbers(count);
  for (int i = 0; i < count; ++i) {
    if (!absl::SimpleAtod(parts[static_cast<size_t>(i)], &numbers[i])) return std::nullopt;
  }
  if (!numbers.allFinite()) return std::nullopt;
  return numbers;
}

namespace {

std::optional<Plane> ReadPlane(absl::string_view word) {
  if (word.size() > 2 && word[1] == '=' && word[0] >= 'x' && word[0] <= 'z') {
    const auto offset = ReadNumbers(word.substr(2), 1);
    if (!offset) return std::nullopt;
    return Plane{Eigen::Vector3d::Unit(word[0] - 'x'), (*offset)[0]};
  }
  const auto numbers = ReadNumbers(word, 4);
  if (!numbers || numbers->head<3>().isZero(0)) return std::nullopt;
  return Plane{numbers->head<3>(), (*numbers)[3]};
}

}  // namespace

absl::StatusOr<std::vector<Plane>> ReadPlaneWords(const std::vector<std::string>& words) {
  std::vector<Plane> planes;
  for (const std::string& word : words) {
    const auto plane = ReadPlane(word);
    if (!plane) {
      return UsageError(absl::StrCat("--plane ", word,
                                     ": must be x=D, y=D, z=D or A,B,C,D with a normal A,B,C that "
                                     "is not zero (0,0,1,0.5)"));
    }
    planes.push_back(*plane);
  }
  return planes;
}

absl::StatusOr<std::vector<ProbeRay>> ReadRayWords(const std::vector<std::string>& words) {
  std::vector<ProbeRay> rays;
  for (const std::string& word : words) {
    const auto numbers = ReadNumbers(word, 6);
    if (!numbers || numbers->tail<3>().isZero(0)) {
      return UsageError(absl::StrCat("--ray ", word,
                                     ": must be X,Y,Z,DX,DY,DZ with a direction that is not zero "
                                     "(0,0,5,0,0,-1)"));
    }
    rays.push_back({numbers->head<3>(), numbers->tail<3>()});
  }
  return rays;
}

}  // namespace rilievo
