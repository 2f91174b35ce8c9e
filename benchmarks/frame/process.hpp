// What the operating system says of this process.
#pragma once

#include <cstdint>

namespace meniscus {

/// Milliseconds that all threads of the process have used of the processors.
double processor_ms();

/// Gives freed memory back and forgets the peak, where the system can (Linux).
void forget_peak_memory();

/// The most bytes that were resident since forget_peak_memory(), or since the start where the
/// system cannot forget.
std::uint64_t peak_memory();

}  // namespace meniscus
