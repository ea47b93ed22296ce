// Certificates for one test, made by the program openssl.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/unit/server/store/test_folder.h"

namespace rilievo {

inline std::string FileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// In `folder`: NAME.pem and NAME.key.
class TestCertificates {
 public:
  explicit TestCertificates(const TestFolder* folder) : folder_(folder) {}

  void MakeAuthority(const std::string& name) const {
    Run("req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=" + name +
        Files(name));
  }

  // Of that authority, for 127.0.0.1; `subject` as "/CN=alice".
  void Make(const std::string& authority, const std::string& name,
            const std::string& subject) const {
    const std::string request = Path(name + ".csr"), names = Path(name + ".ext");
    std::ofstream(names) << "subjectAltName=IP:127.0.0.1\n";
    Run("req -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -subj " + subject + " -keyout " +
        Path(name + ".key") + " -out " + request);
    Run("x509 -req -days 2 -in " + request + " -CA " + Path(authority + ".pem") + " -CAkey " +
        Path(authority + ".key") + " -CAcreateserial -extfile " + names + " -out " +
        Path(name + ".pem"));
  }

  std::string Path(const std::string& file) const { return *folder_ / file; }
  std::string Text(const std::string& file) const { return FileText(Path(file)); }

 private:
  std::string Files(const std::string& name) const {
    return " -keyout " + Path(name + ".key") + " -out " + Path(name + ".pem");
  }
  static void Run(const std::string& arguments) {
    ASSERT_EQ(std::system(("openssl " + arguments + " 2>/dev/null").c_str()), 0) << arguments;
  }

  const TestFolder* folder_;
};

}  // namespace rilievo
