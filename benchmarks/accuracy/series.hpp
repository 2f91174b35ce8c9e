// The settings that the scenes are measured at.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "accuracy/study.hpp"

namespace meniscus::accuracy {

/// One way to show the scenes: what it changes of a Setup.
struct Setting {
  std::string name;  // within its series
  std::function<void(Setup&)> change;
};

struct Series {
  std::string name, what;
  std::vector<Setting> settings;
};

/// main, noise, lattice, spacing, orthographic, wide, narrow, jitter.
const std::vector<Series>& all_series();

/// The series of these names, or all of them where a name is "all". Throws InvalidArgument, with
/// the names there are.
std::vector<Series> series_named(const std::vector<std::string>& names);

/// Seeds for choosing constants are 1 to 99, seeds for reporting 1001 and above: no figure that is
/// reported has been tuned on. `words` is tuning (1, 2, 3), reporting (1001, 1002, 1003) or
/// numbers of one of the two kinds. Throws InvalidArgument.
std::vector<std::uint64_t> seeds_named(const std::vector<std::string>& words);

}  // namespace meniscus::accuracy
