// Reading files by their path.
#pragma once

#include <istream>
#include <memory>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client/formats/open_input.h"
#include "client/formats/unpacked_input.h"

namespace rilievo {

// read(std::istream&) on the file or, for "-", on the standard input, unpacked where it is
// compressed; puts the path before the message of an error.
template <typename Read>
auto WithInput(const std::string& path, Read read)
    -> decltype(read(std::declval<std::istream&>())) {
  const auto named = [&](const absl::Status& status) {
    absl::Status with_path(status.code(), absl::StrCat(path, ": ", status.message()));
    status.ForEachPayload([&](absl::string_view url, const absl::Cord& payload) {
      with_path.SetPayload(url, payload);
    });
    return with_path;
  };
  if (path == "-") {
    const std::unique_ptr<std::istream> standard_input = OpenStandardInput();
    auto result = WithUnpacked(*standard_input, read);
    if (!result.ok()) return named(result.status());
    return result;
  }
  absl::StatusOr<std::ifstream> file = OpenFile(path);
  if (!file.ok()) return file.status();
  auto result = WithUnpacked(*file, read);
  if (!result.ok()) return named(result.status());
  return result;
}

}  // namespace rilievo
