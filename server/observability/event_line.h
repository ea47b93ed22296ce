// How one event becomes one line of the log.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace rilievo {

// Name and value, in the order of the line. Names are the server's own words, values may hold
// anything.
using EventFields = std::vector<std::pair<std::string, std::string>>;

// A JSON object without a line end: time, event, then the fields. Bytes that are not UTF-8 are
// replaced.
std::string EventJson(const std::string& time, const std::string& event, const EventFields& fields);

// "TIME EVENT name="value" ...", without a line end.
std::string EventText(const std::string& time, const std::string& event, const EventFields& fields);

// In quotation marks; what is not printable ASCII, and the characters " and \, become '?': a
// client's words must not forge a second line.
std::string Quoted(const std::string& text);

// Now, in UTC: "2026-01-31T12:00:00Z".
std::string TimeOfLine();

}  // namespace rilievo
