#include "frame/process.hpp"

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "base/printed.hpp"

namespace meniscus {

double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double OtherWork::processors() const {
  const Clocks now = read();
  return now.wall > begin_.wall ? std::max(0.0, (now.all - begin_.all) - (now.own - begin_.own)) /
                                      (now.wall - begin_.wall)
                                : 0;
}

OtherWork::Clocks OtherWork::read() {
  Clocks clocks;
  clocks.wall =
      1e-9 * static_cast<double>(std::chrono::steady_clock::now().time_since_epoch().count());
  clocks.own = 1e-3 * processor_ms();
  std::ifstream stat("/proc/stat");  // cpu user nice system idle iowait irq softirq steal
  std::string name;
  double ticks[8] = {};
  stat >> name;
  for (double& tick : ticks) stat >> tick;
  if (!stat) return {};
  clocks.all = (ticks[0] + ticks[1] + ticks[2] + ticks[5] + ticks[6]) /
               static_cast<double>(sysconf(_SC_CLK_TCK));
  return clocks;
}

std::string other_work_warning(double processors, const std::string& what) {
  return printed("other programs kept %.1f processors busy: %s may be off", processors,
                 what.c_str());
}

void forget_peak_memory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}

std::uint64_t peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    std::uint64_t kibibytes = 0;
    if (key == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
    std::getline(status, key);
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace meniscus
