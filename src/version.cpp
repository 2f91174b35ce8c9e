#include "meniscus/meniscus.hpp"

namespace meniscus {

std::string version() { return MENISCUS_VERSION; }

}  // namespace meniscus
