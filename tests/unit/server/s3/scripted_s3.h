// A store that answers as a test says: what a real one does once in a thousand times.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "server/os/file_descriptor.h"

namespace rilievo {

struct S3Answer {
  int http = 200;
  std::string body = "";
  bool lost = false;  // the request is taken, and the connection closed

  static S3Answer Error(int http, const std::string& code) {
    return {http, absl::StrCat("<Error><Code>", code, "</Code></Error>")};
  }
};

// HTTP on a port of loopback. Checks no signatures, keeps nothing.
class ScriptedS3 {
 public:
  // Answers each request with the next of `answers`, then with `rest`, each after `delay`.
  explicit ScriptedS3(std::vector<S3Answer> answers, S3Answer rest = {},
                      std::chrono::milliseconds delay = {})
      : answers_(std::move(answers)), rest_(std::move(rest)), delay_(delay) {
    listener_ = FileDescriptor(socket(AF_INET, SOCK_STREAM, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const general = reinterpret_cast<sockaddr*>(&address);
    if (bind(listener_.number(), general, size) != 0 || listen(listener_.number(), 64) != 0 ||
        getsockname(listener_.number(), general, &size) != 0) {
      return;
    }
    port_ = ntohs(address.sin_port);
    acceptor_ = std::thread([this] { Accept(); });
  }

  ~ScriptedS3() {
    shutdown(listener_.number(), SHUT_RDWR);
    if (acceptor_.joinable()) acceptor_.join();
    for (const FileDescriptor& connection : connections_) {
      shutdown(connection.number(), SHUT_RDWR);
    }
    for (std::thread& thread : threads_) thread.join();
  }

  std::string url() const { return absl::StrCat("s3://bucket?endpoint=http://127.0.0.1:", port_); }

  // "GET /bucket/key", in the order they came.
  std::vector<std::string> requests() const {
    const std::lock_guard lock(mutex_);
    return requests_;
  }

 private:
  void Accept() {
    for (;;) {
      FileDescriptor connection(accept(listener_.number(), nullptr, nullptr));
      if (!connection.valid()) return;
      connections_.push_back(std::move(connection));
      threads_.emplace_back([this, &kept = connections_.back()] { Serve(kept); });
    }
  }

  void Serve(const FileDescriptor& connection) {
    std::string head;
    for (char c; connection.Read(&c, 1).ok();) {
      head += c;
      if (!absl::EndsWith(head, "\r\n\r\n")) continue;
      TakeBody(connection, head);
      if (!Reply(connection, head.substr(0, head.find(" HTTP/")))) break;
      head.clear();
    }
    shutdown(connection.number(), SHUT_RDWR);
  }

  static void TakeBody(const FileDescriptor& connection, const std::string& head) {
    const size_t at = head.find("Content-Length: ");
    if (at == std::string::npos) return;
    const size_t begin = at + sizeof("Content-Length: ") - 1;
    size_t size = 0;
    if (!absl::SimpleAtoi(head.substr(begin, head.find('\r', begin) - begin), &size)) return;
    std::string body(size, '\0');
    connection.Read(body.data(), size).IgnoreError();
  }

  bool Reply(const FileDescriptor& connection, const std::string& request) {
    S3Answer answer = rest_;
    {
      const std::lock_guard lock(mutex_);
      if (requests_.size() < answers_.size()) answer = answers_[requests_.size()];
      requests_.push_back(request);
    }
    std::this_thread::sleep_for(delay_);
    if (answer.lost) return false;
    const bool head_alone = absl::StartsWith(request, "HEAD ");
    const std::string text =
        absl::StrCat("HTTP/1.1 ", answer.http, " so\r\nContent-Length: ", answer.body.size(),
                     "\r\n\r\n", head_alone ? "" : answer.body);
    return connection.Send(text.data(), text.size()).ok();
  }

  const std::vector<S3Answer> answers_;
  const S3Answer rest_;
  const std::chrono::milliseconds delay_;
  FileDescriptor listener_;
  int port_ = 0;
  mutable std::mutex mutex_;
  std::vector<std::string> requests_;
  std::list<FileDescriptor> connections_;
  std::list<std::thread> threads_;
  std::thread acceptor_;
};

}  // namespace rilievo
