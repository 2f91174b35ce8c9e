// The stages against double precision: the same plain loops that the tests have.
#pragma once

#include <string>
#include <vector>

#include "device/device.hpp"

namespace meniscus::verify {

/// One output of a stage against double precision: of the value that uses the most of its error
/// bound, how far it is off and how far it may be, in units in the last place of the expected value
/// (or, where terms cancel in it, of the size that the case names).
struct ReferenceError {
  std::string kernel;  // that wrote the output
  std::string output;  // "depth", "normal.x"
  double ulp = 0;      // infinite where a value is there and should not be, or the reverse
  double allowed = 0;  // derived where the reference is (verify/reference)
};

/// Such an error, or what is allowed: "1.25 ulp".
std::string error_in_words(double ulp);

/// A stage's case: seeded inputs of a size, and the errors of what it makes of them.
struct StageCase {
  const char* stage;
  std::vector<int> sizes;  // ascending; the smallest is at most a few thousand work-items
  std::vector<ReferenceError> (*run)(Device& device, int size);
};

/// Every stage that has a reference, in the order of the pipeline. They run at the device's
/// vector_width.
const std::vector<StageCase>& stage_cases();

}  // namespace meniscus::verify
