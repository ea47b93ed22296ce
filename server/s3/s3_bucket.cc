#include "server/s3/s3_bucket.h"

#include <curl/curl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "server/s3/s3_credentials.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kFirstPause{200}, kLongestPause{2000};
// Without an answer to a connection.
constexpr long kConnectSeconds = 5;
// An answer that is not an object: S3 has none that is longer.
constexpr size_t kMostText = 64 << 10;

std::string HashOf(std::string_view bytes) {
  Sha256 hash;
  AddBytes(bytes.data(), bytes.size(), &hash);
  return ContentName(hash);
}

// What stands between <name> and </name>, for a reader or a query: letters, digits and a few more.
std::string Element(const std::string& xml, const std::string& name) {
  const size_t begin = xml.find("<" + name + ">");
  if (begin == std::string::npos) return "";
  std::string text = xml.substr(begin + name.size() + 2, 1024);
  return text.substr(0, text.find('<'));
}

// The code of an error, such as NoSuchKey.
std::string CodeOf(const std::string& xml) {
  std::string code = Element(xml, "Code");
  const bool plain = std::all_of(code.begin(), code.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c));
  });
  return plain && code.size() < 64 ? code : "";
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const bool plain = absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ||
                       c == '.' || c == '~';
    if (plain) escaped += c;
    if (!plain) {
      absl::StrAppend(&escaped, "%",
                      absl::AsciiStrToUpper(
                          absl::StrCat(absl::Hex(static_cast<unsigned char>(c), absl::kZeroPad2))));
    }
  }
  return escaped;
}

// A 404 that does not say what is missing is a proxy's before the store.
bool MayPass(long http, const std::string& code) {
  return http >= 500 || http == 429 || http == 408 || code == "RequestTimeout" ||
         (http == 404 && !absl::StartsWith(code, "NoSuch"));
}

// Of an answer that reports a failure. `missing`: the code that makes it NOT_FOUND, if any.
absl::Status StatusOfAnswer(long http, const std::string& code, const std::string& missing) {
  const std::string words = absl::StrCat("S3: HTTP ", http, code.empty() ? "" : " ", code);
  if (code == "NoSuchBucket") return absl::UnavailableError(words + ": make the bucket");
  if (http == 404 && !missing.empty() && code == missing) {
    return absl::NotFoundError("no such object is stored");
  }
  if (http == 507 || absl::StrContains(code, "Quota") || code == "EntityTooLarge") {
    return absl::ResourceExhaustedError(words);
  }
  if (http >= 400 && http <= 403) {
    return absl::UnavailableError(
        words + ": check the credentials, what they allow, the region, and this machine's clock");
  }
  if (http >= 300 && http < 400) {
    return absl::UnavailableError(words + ": check endpoint and region");
  }
  return absl::UnavailableError(words);
}

}  // namespace

// What is asked. `missing`: the code of S3 that says what was asked for is not there; no other 404
// says so. `into`: where the bytes of an object go; `moved` is called as they come.
struct S3Bucket::Request {
  const char* method;
  const std::string& key;
  std::string query = {};
  std::string_view body = {};
  std::string missing = {};
  const FileDescriptor* into = nullptr;
  std::function<void()> moved = {};
};

struct S3Bucket::Answer {
  long http = 0;
  std::string text;  // of an answer without an object
  std::string tag;   // of what was put, with its quotes
};

// A connection that may be used again, and what comes over it.
class S3Bucket::Connection {
 public:
  explicit Connection(std::chrono::seconds stall) : stall_(stall), curl_(curl_easy_init()) {}
  ~Connection() { curl_easy_cleanup(curl_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  absl::StatusOr<Answer> Perform(const S3Place& place, const S3Credentials& credentials,
                                 const Request& request);

 private:
  static size_t TakeBody(char* data, size_t size, size_t count, void* self);
  static size_t TakeHeader(char* data, size_t size, size_t count, void* self);
  void Prepare(const S3Place& place, const S3Credentials& credentials, const Request& request);

  const std::chrono::seconds stall_;
  CURL* const curl_;
  const FileDescriptor* into_ = nullptr;
  std::function<void()> moved_;
  Answer answer_;
  absl::Status taken_;
};

size_t S3Bucket::Connection::TakeBody(char* data, size_t size, size_t count, void* self) {
  auto* const mine = static_cast<Connection*>(self);
  curl_easy_getinfo(mine->curl_, CURLINFO_RESPONSE_CODE, &mine->answer_.http);
  if (mine->into_ != nullptr && mine->answer_.http == 200) {
    if (mine->moved_) mine->moved_();
    mine->taken_ = mine->into_->Write(data, size * count);
    return mine->taken_.ok() ? size * count : 0;
  }
  std::string& text = mine->answer_.text;
  text.append(data, std::min(size * count, kMostText - text.size()));
  return size * count;
}

size_t S3Bucket::Connection::TakeHeader(char* data, size_t size, size_t count, void* self) {
  const absl::string_view line(data, size * count);
  if (absl::StartsWithIgnoreCase(line, "etag:")) {
    static_cast<Connection*>(self)->answer_.tag =
        std::string(absl::StripAsciiWhitespace(line.substr(sizeof("etag:") - 1)));
  }
  return size * count;
}

void S3Bucket::Connection::Prepare(const S3Place& place, const S3Credentials& credentials,
                                   const Request& request) {
  curl_easy_reset(curl_);
  const std::string url =
      absl::StrCat(place.endpoint, "/", place.bucket, "/", place.prefix, request.key,
                   request.query.empty() ? "" : "?", request.query);
  const std::string signature = absl::StrCat("aws:amz:", place.region, ":s3");
  const std::string_view method = request.method;
  curl_easy_setopt(curl_, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl_, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl_, CURLOPT_AWS_SIGV4, signature.c_str());
  curl_easy_setopt(curl_, CURLOPT_USERNAME, credentials.key_id.c_str());
  curl_easy_setopt(curl_, CURLOPT_PASSWORD, credentials.secret.c_str());
  if (method == "PUT" || method == "POST") {
    curl_easy_setopt(curl_, CURLOPT_POSTFIELDS,
                     request.body.data() == nullptr ? "" : request.body.data());
    curl_easy_setopt(curl_, CURLOPT_POSTFIELDSIZE_LARGE,
                     static_cast<curl_off_t>(request.body.size()));
  }
  if (method == "HEAD") curl_easy_setopt(curl_, CURLOPT_NOBODY, 1L);
  curl_easy_setopt(curl_, CURLOPT_CUSTOMREQUEST, request.method);
  curl_easy_setopt(curl_, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl_, CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  curl_easy_setopt(curl_, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(curl_, CURLOPT_LOW_SPEED_TIME, static_cast<long>(stall_.count()));
  const char* const authorities = std::getenv("AWS_CA_BUNDLE");
  if (authorities != nullptr && *authorities != '\0') {
    curl_easy_setopt(curl_, CURLOPT_CAINFO, authorities);
  }
  curl_easy_setopt(curl_, CURLOPT_WRITEFUNCTION, &Connection::TakeBody);
  curl_easy_setopt(curl_, CURLOPT_WRITEDATA, this);
  curl_easy_setopt(curl_, CURLOPT_HEADERFUNCTION, &Connection::TakeHeader);
  curl_easy_setopt(curl_, CURLOPT_HEADERDATA, this);
}

absl::StatusOr<S3Bucket::Answer> S3Bucket::Connection::Perform(const S3Place& place,
                                                               const S3Credentials& credentials,
                                                               const Request& request) {
  if (curl_ == nullptr) return absl::ResourceExhaustedError("S3: no memory for a connection");
  Prepare(place, credentials, request);
  answer_ = {};
  taken_ = absl::OkStatus();
  into_ = request.into;
  moved_ = request.moved;
  if (into_ != nullptr &&
      (ftruncate(into_->number(), 0) != 0 || lseek(into_->number(), 0, SEEK_SET) != 0)) {
    return StatusOfErrno(errno, "emptying a file");
  }
  curl_slist* headers =
      curl_slist_append(nullptr, ("x-amz-content-sha256: " + HashOf(request.body)).c_str());
  if (!credentials.token.empty()) {
    headers = curl_slist_append(headers, ("x-amz-security-token: " + credentials.token).c_str());
  }
  curl_easy_setopt(curl_, CURLOPT_HTTPHEADER, headers);
  const CURLcode done = curl_easy_perform(curl_);
  curl_easy_setopt(curl_, CURLOPT_HTTPHEADER, nullptr);
  curl_slist_free_all(headers);
  RILIEVO_RETURN_IF_ERROR(taken_);
  if (done != CURLE_OK) {
    return absl::UnavailableError(
        absl::StrCat("S3: ", place.endpoint, ": ", curl_easy_strerror(done)));
  }
  curl_easy_getinfo(curl_, CURLINFO_RESPONSE_CODE, &answer_.http);
  return std::move(answer_);
}

S3Bucket::S3Bucket(S3Place place, const Patience& patience)
    : place_(std::move(place)), patience_(patience) {
  static const CURLcode begun = curl_global_init(CURL_GLOBAL_DEFAULT);
  static_cast<void>(begun);
}

S3Bucket::~S3Bucket() = default;

std::unique_ptr<S3Bucket::Connection> S3Bucket::TakeConnection() const {
  const std::lock_guard lock(mutex_);
  if (idle_.empty()) return std::make_unique<Connection>(patience_.stall);
  auto taken = std::move(idle_.back());
  idle_.pop_back();
  return taken;
}

void S3Bucket::GiveBack(std::unique_ptr<Connection> connection) const {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(connection));
}

absl::StatusOr<S3Bucket::Answer> S3Bucket::AskOnce(const Request& request, bool* may_pass) const {
  *may_pass = false;
  RILIEVO_ASSIGN_OR_RETURN(const S3Credentials credentials, ReadS3Credentials());
  auto connection = TakeConnection();
  absl::StatusOr<Answer> answer = connection->Perform(place_, credentials, request);
  *may_pass = absl::IsUnavailable(answer.status());
  // One that failed may be out of step.
  RILIEVO_RETURN_IF_ERROR(answer.status());
  GiveBack(std::move(connection));
  // The end of an object in parts may fail after the answer has begun.
  const std::string code = CodeOf(answer->text);
  if (answer->http >= 200 && answer->http < 300 && code.empty()) return answer;
  const long http = answer->http < 300 ? 500 : answer->http;
  *may_pass = MayPass(http, code);
  return StatusOfAnswer(http, code, request.missing);
}

absl::StatusOr<S3Bucket::Answer> S3Bucket::Ask(const Request& request) const {
  const Clock::time_point end = Clock::now() + patience_.retry;
  for (auto pause = kFirstPause;; pause = std::min(2 * pause, kLongestPause)) {
    bool may_pass = false;
    absl::StatusOr<Answer> answer = AskOnce(request, &may_pass);
    if (answer.ok() || !may_pass || Clock::now() + pause > end) return answer;
    std::this_thread::sleep_for(pause);
  }
}

absl::Status S3Bucket::Put(const std::string& key, std::string_view bytes) const {
  return Ask({.method = "PUT", .key = key, .body = bytes}).status();
}

absl::Status S3Bucket::Get(const std::string& key, const FileDescriptor& file,
                           const std::function<void()>& moved) const {
  return Ask({.method = "GET", .key = key, .missing = "NoSuchKey", .into = &file, .moved = moved})
      .status();
}

absl::Status S3Bucket::Remove(const std::string& key) const {
  const absl::Status removed =
      Ask({.method = "DELETE", .key = key, .missing = "NoSuchKey"}).status();
  return absl::IsNotFound(removed) ? absl::OkStatus() : removed;
}

absl::StatusOr<std::string> S3Bucket::BeginParts(const std::string& key) const {
  RILIEVO_ASSIGN_OR_RETURN(const Answer answer,
                           Ask({.method = "POST", .key = key, .query = "uploads="}));
  std::string upload = Element(answer.text, "UploadId");
  if (upload.empty()) return absl::UnavailableError("S3: an upload in parts without a name");
  return upload;
}

absl::StatusOr<std::string> S3Bucket::PutPart(const std::string& key, const std::string& upload,
                                              int number, std::string_view bytes) const {
  RILIEVO_ASSIGN_OR_RETURN(
      Answer answer,
      Ask({.method = "PUT",
           .key = key,
           .query = absl::StrCat("partNumber=", number, "&uploadId=", Escaped(upload)),
           .body = bytes}));
  return std::move(answer.tag);
}

absl::Status S3Bucket::EndParts(const std::string& key, const std::string& upload,
                                const std::vector<std::string>& tags) const {
  std::string list = "<CompleteMultipartUpload xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">";
  for (size_t i = 0; i < tags.size(); ++i) {
    absl::StrAppend(&list, "<Part><PartNumber>", i + 1, "</PartNumber><ETag>", tags[i],
                    "</ETag></Part>");
  }
  list += "</CompleteMultipartUpload>";
  const absl::Status ended = Ask({.method = "POST",
                                  .key = key,
                                  .query = "uploadId=" + Escaped(upload),
                                  .body = list,
                                  .missing = "NoSuchUpload"})
                                 .status();
  if (!absl::IsNotFound(ended)) return ended;
  // An attempt whose answer was lost may have ended it. That no object is there is UNAVAILABLE: a
  // HEAD's 404 has no code.
  return Ask({.method = "HEAD", .key = key}).status();
}

absl::Status S3Bucket::DropParts(const std::string& key, const std::string& upload) const {
  const absl::Status dropped = Ask({.method = "DELETE",
                                    .key = key,
                                    .query = "uploadId=" + Escaped(upload),
                                    .missing = "NoSuchUpload"})
                                   .status();
  return absl::IsNotFound(dropped) ? absl::OkStatus() : dropped;
}

}  // namespace rilievo
