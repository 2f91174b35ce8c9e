// What of the library others see where it is a shared one.
#pragma once

// Whoever links the static library has MENISCUS_STATIC defined by its package, and the linker hides
// what comes out of it, so that a plug-in that takes it in shows none of it.
#ifdef MENISCUS_STATIC
#define MENISCUS_API
#define MENISCUS_INTERNAL
#else
#define MENISCUS_API __attribute__((visibility("default")))
#define MENISCUS_INTERNAL __attribute__((visibility("hidden")))
#endif
