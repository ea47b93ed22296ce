// A GLB file taken apart, as its specification says.
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>

namespace rilievo::testing {

struct GlbParts {
  nlohmann::json json;
  std::string binary;
};

template <typename T>
T LoadAt(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

inline GlbParts TakeGlbApart(const std::string& bytes) {
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(LoadAt<uint32_t>(bytes, 4), 2u);
  EXPECT_EQ(LoadAt<uint32_t>(bytes, 8), bytes.size());
  const auto json_bytes = LoadAt<uint32_t>(bytes, 12);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  EXPECT_EQ(json_bytes % 4, 0u);
  EXPECT_EQ(bytes.substr(24 + json_bytes, 4), std::string("BIN\0", 4));
  EXPECT_EQ(LoadAt<uint32_t>(bytes, 20 + json_bytes), bytes.size() - 28 - json_bytes);
  return {nlohmann::json::parse(bytes.substr(20, json_bytes)), bytes.substr(28 + json_bytes)};
}

}  // namespace rilievo::testing
