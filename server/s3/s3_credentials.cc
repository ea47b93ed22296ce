#include "server/s3/s3_credentials.h"

#include <cstdlib>
#include <fstream>
#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace rilievo {
namespace {

std::string Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

// "key = value" lines of the section [name].
std::map<std::string, std::string> Section(const std::string& path, const std::string& name) {
  std::map<std::string, std::string> values;
  std::ifstream file(path);
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    const absl::string_view text = absl::StripAsciiWhitespace(line);
    if (!text.empty() && text.front() == '[') inside = text == absl::StrCat("[", name, "]");
    const size_t equals = text.find('=');
    if (!inside || equals == absl::string_view::npos || text.front() == '#') continue;
    values[std::string(absl::StripAsciiWhitespace(text.substr(0, equals)))] =
        std::string(absl::StripAsciiWhitespace(text.substr(equals + 1)));
  }
  return values;
}

}  // namespace

std::string S3CredentialsFile() {
  const std::string named = Variable("AWS_SHARED_CREDENTIALS_FILE"), home = Variable("HOME");
  if (!named.empty()) return named;
  return home.empty() ? "" : home + "/.aws/credentials";
}

absl::StatusOr<S3Credentials> ReadS3Credentials() {
  S3Credentials found{Variable("AWS_ACCESS_KEY_ID"), Variable("AWS_SECRET_ACCESS_KEY"),
                      Variable("AWS_SESSION_TOKEN")};
  if (!found.key_id.empty() && !found.secret.empty()) return found;
  const std::string path = S3CredentialsFile(), profile = Variable("AWS_PROFILE");
  const std::string section = profile.empty() ? "default" : profile;
  auto values = Section(path, section);
  found = {values["aws_access_key_id"], values["aws_secret_access_key"],
           values["aws_session_token"]};
  if (!found.key_id.empty() && !found.secret.empty()) return found;
  return absl::UnavailableError(absl::StrCat(
      "S3: no credentials: set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or give "
      "aws_access_key_id and aws_secret_access_key in section [",
      section, "] of ", path.empty() ? "a file that AWS_SHARED_CREDENTIALS_FILE names" : path));
}

}  // namespace rilievo
