// What is told of a kept job.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "rilievo/v1/jobs.pb.h"

namespace rilievo {

// "succeeded" of JOB_STATE_SUCCEEDED; "unknown (9)" of a state that this version does not know.
std::string StateName(v1::JobState state);

// 2026-11-28T16:40:32Z; - where it is not set, or no time.
std::string TimeText(const google::protobuf::Timestamp& time);

nlohmann::ordered_json JsonOf(const v1::Job& job);

// In lines, for people.
std::string WordsOf(const v1::Job& job);

}  // namespace rilievo
