#pragma once
#include <cstdlib>
#include <string>
inline bool XpIs(const char* name) {
  const char* v = std::getenv("XP");
  const std::string all = std::string(",") + (v ? v : "") + ",";
  return all.find(std::string(",") + name + ",") != std::string::npos;
}
inline double XpNum(const char* name, double or_else) {
  const char* v = std::getenv(name);
  return v ? std::atof(v) : or_else;
}
#define XP(name) ([] { static const bool on = XpIs(name); return on; }())
#define XPN(name, d) ([] { static const double on = XpNum(name, d); return on; }())
