// The program with OpenCL calls that fail.
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "program/cli/program.hpp"

namespace meniscus::test {

class FaultyRuntime : public Program {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "nothing can be preloaded before the sanitizer";
#endif
  }

  /// The settings of failing_call.hpp.
  static Conditions failing(std::vector<std::pair<std::string, std::string>> settings) {
    settings.emplace_back("LD_PRELOAD", MENISCUS_FAILING_CALL);
    return {.environment = std::move(settings)};
  }

  static int count(const std::string& text, const std::string& part) {
    int found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
      ++found;
    return found;
  }
};

}  // namespace meniscus::test
