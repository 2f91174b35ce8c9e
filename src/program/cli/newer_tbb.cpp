#include "program/cli/newer_tbb.hpp"

#include <unistd.h>

#include <cstdlib>
#include <string>

#include "device/installation.hpp"

namespace meniscus::cli {

void start_with_newer_tbb(char** argv) {
  constexpr const char* kStarted = "MENISCUS_STARTED_WITH_NEWER_TBB";  // once is enough
  if (std::getenv(kStarted)) return;
  std::string preload = newer_tbb();
  if (preload.empty()) return;
  if (const char* others = std::getenv("LD_PRELOAD"); others && *others) {
    preload += ':';
    preload += others;
  }
  setenv(kStarted, "1", 1);
  setenv("LD_PRELOAD", preload.c_str(), 1);
  execv("/proc/self/exe", argv);
  // Then without: the other platforms work, and the message about this one says what to do.
}

}  // namespace meniscus::cli
