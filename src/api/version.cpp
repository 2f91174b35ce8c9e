#include "meniscus/version.hpp"

#include "meniscus/extract.hpp"

namespace meniscus {

std::string version() {
  return std::to_string(MENISCUS_VERSION_MAJOR) + "." + std::to_string(MENISCUS_VERSION_MINOR) +
         "." + std::to_string(MENISCUS_VERSION_PATCH);
}

}  // namespace meniscus
