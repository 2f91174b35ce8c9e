// Vector instructions of x86-64, where the compiler makes functions for processors that have them:
// MENISCUS_X86 is defined then.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define MENISCUS_X86
#endif
