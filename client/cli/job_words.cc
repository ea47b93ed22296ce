#include "client/cli/job_words.h"

#include <cctype>
#include <ctime>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "client/cli/server_words.h"
#include "client/library/status_conversion.h"

namespace rilievo {

std::string StateName(v1::JobState state) {
  if (!v1::JobState_IsValid(state)) return absl::StrCat("unknown (", static_cast<int>(state), ")");
  std::string name = v1::JobState_Name(state).substr(sizeof("JOB_STATE_") - 1);
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return name;
}

std::string TimeText(const google::protobuf::Timestamp& time) {
  if (time.seconds() == 0) return "-";
  const std::time_t seconds = time.seconds();
  std::tm utc{};
  char text[32];
  if (gmtime_r(&seconds, &utc) == nullptr) return "-";
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

nlohmann::ordered_json JsonOf(const v1::Job& job) {
  nlohmann::ordered_json json = {{"job_id", job.job_id()},
                                 {"request_id", job.request_id()},
                                 {"scan_id", job.scan_id()},
                                 {"state", StateName(job.state())},
                                 {"attempts", job.attempts()},
                                 {"created", TimeText(job.create_time())},
                                 {"started", TimeText(job.start_time())},
                                 {"ended", TimeText(job.end_time())}};
  if (job.has_error()) json["error"] = WordsOf(StatusFromRpc(job.error()));
  if (job.has_surface()) json["surface_bytes"] = job.surface().total_bytes();
  return json;
}

std::string WordsOf(const v1::Job& job) {
  std::string words = absl::StrCat(
      "job ", job.job_id(), ": ", StateName(job.state()), "\n  request   ", job.request_id(),
      "\n  scan      ", job.scan_id(), "\n  created   ", TimeText(job.create_time()),
      "\n  started   ", TimeText(job.start_time()), "\n  ended     ", TimeText(job.end_time()),
      "\n  attempts  ", job.attempts(), "\n");
  if (job.has_surface()) {
    absl::StrAppend(&words, "  surface   ", job.surface().total_bytes(), " bytes\n");
  }
  if (job.has_error()) {
    absl::StrAppend(&words, "  error     ", WordsOf(StatusFromRpc(job.error())), "\n");
  }
  return words;
}

}  // namespace rilievo
