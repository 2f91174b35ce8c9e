// What the operating system says of this process.
#pragma once

#include <cstdint>
#include <string>

namespace meniscus {

/// Milliseconds that all threads of the process have used of the processors.
double processor_ms();

/// How many processors other processes keep busy, on average since it was made; 0 where the system
/// does not tell (it does on Linux).
class OtherWork {
 public:
  double processors() const;

 private:
  struct Clocks {
    double wall = 0, all = 0, own = 0;  // seconds
  };
  static Clocks read();
  Clocks begin_ = read();
};

/// "other programs kept 1.0 processors busy: times and roofline may be off", `what` being off.
std::string other_work_warning(double processors, const std::string& what);

/// Gives freed memory back and forgets the peak, where the system can (Linux).
void forget_peak_memory();

/// The most bytes that were resident since forget_peak_memory(), or since the start where the
/// system cannot forget.
std::uint64_t peak_memory();

}  // namespace meniscus
