// The front of deploy/front before a server of a test.
#pragma once

#include <sys/types.h>

#include <string>

namespace rilievo::stress {

// nginx with the configuration that is shipped, but for ports, TLS and folders.
class Front {
 public:
  // Before the rilievod at `server_port` of 127.0.0.1.
  explicit Front(int server_port);
  ~Front();
  Front(const Front&) = delete;
  Front& operator=(const Front&) = delete;

  // Why there is none; empty when it runs.
  const std::string& missing() const { return missing_; }
  int port() const { return port_; }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  // Empty when it was started.
  std::string Start(int server_port);

  std::string folder_, missing_;
  int port_ = 0;
  pid_t process_ = -1;
};

}  // namespace rilievo::stress
