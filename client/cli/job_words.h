// What is told of a kept job.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "rilievo/v1/jobs.pb.h"

namespace rilievo {

// "succeeded" of JOB_STATE_SUCCEEDED.
std::string StateName(v1::JobState state);

// 2026-11-28T16:40:32Z; - where it is not set.
std::string TimeText(const google::protobuf::Timestamp& time);

nlohmann::ordered_json JsonOf(const v1::Job& job);

// In lines, for people.
std::string WordsOf(const v1::Job& job);

}  // namespace rilievo
