#include "server/observability/event_line.h"

#include <ctime>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"

namespace rilievo {

std::string EventJson(const std::string& time, const std::string& event,
                      const EventFields& fields) {
  nlohmann::ordered_json json = {{"time", time}, {"event", event}};
  for (const auto& [name, value] : fields) json[name] = value;
  return json.dump(-1, ' ', /*ensure_ascii=*/true,
                   nlohmann::ordered_json::error_handler_t::replace);
}

std::string EventText(const std::string& time, const std::string& event,
                      const EventFields& fields) {
  std::string line = absl::StrCat(time, " ", event);
  for (const auto& [name, value] : fields) absl::StrAppend(&line, " ", name, "=", Quoted(value));
  return line;
}

std::string Quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c < ' ' || c > '~' || c == '"' || c == '\\' ? '?' : c;
  return result + "\"";
}

std::string TimeOfLine() {
  char time[32];
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  std::strftime(time, sizeof(time), "%Y-%m-%dT%H:%M:%SZ", gmtime_r(&now, &utc));
  return time;
}

}  // namespace rilievo
