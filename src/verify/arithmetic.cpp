#include "verify/arithmetic.hpp"

namespace meniscus::verify {

void probe_arithmetic(Device& device, const Tell& tell) {
  probe_expressions(device, tell);
  probe_execution(device, tell);
}

}  // namespace meniscus::verify
