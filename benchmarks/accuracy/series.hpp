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

/// What settings change: the particles, how the camera sees them, or the frames that follow.
enum class Changes { particles, view, frames };

struct Series {
  std::string name, what;
  Changes changes;
  std::vector<Setting> settings;
};

/// main, noise, lattice, spacing, orthographic, wide, narrow, jitter.
const std::vector<Series>& all_series();

/// The series of these names, or all of them where a name is "all". Throws InvalidArgument, with
/// the names there are.
std::vector<Series> series_named(const std::vector<std::string>& names);

/// Prints the title of every setting of these series and calls measure(setup, prefix) with what it
/// makes of the given setup, and its file_prefix(). Throws as series_named(), and where a series
/// changes more than `most`.
void for_each_setting(const std::vector<std::string>& names, const Setup& given, Changes most,
                      const std::function<void(const Setup&, const std::string&)>& measure);

/// What names of files that are written for a setting begin with: "noise_.29_s_"; of main nothing.
std::string file_prefix(const std::string& series, const std::string& setting);

/// "series noise, setting .29 s: noise of each coordinate", after an empty line.
void print_title(const Series& series, const Setting& setting);

/// Seeds for choosing constants are 1 to 99, seeds for reporting 1001 and above: no figure that is
/// reported has been tuned on. `words` is tuning (1, 2, 3), reporting (1001, 1002, 1003) or
/// numbers of one of the two kinds. Throws InvalidArgument.
std::vector<std::uint64_t> seeds_named(const std::vector<std::string>& words);

}  // namespace meniscus::accuracy
