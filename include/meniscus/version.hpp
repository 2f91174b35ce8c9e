// The version of these headers; version() is that of the library they are used with.
#pragma once

// The build of the library and that of the Python package read these three.
#define MENISCUS_VERSION_MAJOR 0
#define MENISCUS_VERSION_MINOR 1
#define MENISCUS_VERSION_PATCH 0

/// Grows with every version: MENISCUS_VERSION >= MENISCUS_VERSION_OF(0, 2, 0).
#define MENISCUS_VERSION_OF(major, minor, patch) ((major)*1000000 + (minor)*1000 + (patch))
#define MENISCUS_VERSION \
  MENISCUS_VERSION_OF(MENISCUS_VERSION_MAJOR, MENISCUS_VERSION_MINOR, MENISCUS_VERSION_PATCH)
