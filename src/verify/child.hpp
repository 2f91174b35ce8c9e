// What the processes do that `meniscus verify` starts. They write lines of JSON to standard output.
#pragma once

#include <string>

namespace meniscus::verify {

/// Tells of the devices that `selector` names.
void list_as_child(const std::string& selector);

/// Does what a plan says, which is a text of the parent's (to_text()).
void run_as_child(const std::string& plan);

}  // namespace meniscus::verify
