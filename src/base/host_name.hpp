// What this machine is called.
#pragma once

#include <string>

namespace meniscus {

/// The name that the operating system gives this machine; empty where it has none.
std::string host_name();

}  // namespace meniscus
