#include "accuracy/series.hpp"

#include <algorithm>
#include <charconv>
#include <cstdio>

#include "meniscus/error.hpp"

namespace meniscus::accuracy {
namespace {

/// Settings of one number each, named with it.
template <class Change>
std::vector<Setting> each_of(const std::vector<std::string>& values, const std::string& unit,
                             const Change& change) {
  std::vector<Setting> settings;
  for (const std::string& value : values)
    settings.push_back({value + " " + unit, [change, number = std::stod(value)](Setup& setup) {
                          change(setup, number);
                        }});
  return settings;
}

std::vector<Series> make_series() {
  return {
      {"main",
       "relaxed, perspective, the scenes' own 8 to 20 pixels per s; noise .05 s unless --noise "
       "says otherwise",
       Changes::particles,
       {{"main", [](Setup&) {}}}},
      {"noise", "noise of each coordinate", Changes::particles,
       each_of({"0", ".05", ".08", ".12", ".2", ".29"}, "s",
               [](Setup& s, double noise) { s.noise = noise; })},
      {"lattice",
       "unrelaxed: cells of a cubic lattice whose centres lie inside, which has the right mass, or "
       "s/2 deep",
       Changes::particles,
       {{"inside", [](Setup& s) { s.filling = Filling::lattice; }},
        {"deep", [](Setup& s) { s.filling = Filling::deep_lattice; }}}},
      {"random",
       "one particle for each s^3 anywhere in the solid, as FLIP and MPM leave them",
       Changes::particles,
       {{"random",
         [](Setup& s) {
           s.filling = Filling::random;
           s.noise = 0;
         }}}},
      {"spacing", "pixels per s at the target", Changes::view,
       each_of({"2", "3", "5", "8", "12", "20", "40"}, "pixels",
               [](Setup& s, double scale) { s.scale = scale; })},
      {"orthographic",
       "orthographic cameras",
       Changes::view,
       {{"orthographic", [](Setup& s) { s.orthographic = true; }}}},
      {"wide",
       "a wide field of view (about 65 degrees): the eye nearer, the target as large as before",
       Changes::view,
       {{"65 degrees", [](Setup& s) { s.distance = 0.6; }}}},
      {"narrow",
       "a narrow field of view (about 12 degrees): the eye farther, the target as large as before",
       Changes::view,
       {{"12 degrees", [](Setup& s) { s.distance = 4; }}}},
      {"jitter", "particles jittered anew in each frame, whose flicker is measured",
       Changes::frames, each_of({".01"}, "s", [](Setup& s, double jitter) { s.jitter = jitter; })},
  };
}

constexpr std::uint64_t kLastTuning = 99, kFirstReporting = 1001;

std::uint64_t number_in(const std::string& word) {
  std::uint64_t number = 0;
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(word.data(), end, number);
  const bool known = (number >= 1 && number <= kLastTuning) || number >= kFirstReporting;
  require(error == std::errc() && at == end && known,
          "--seeds has '" + word +
              "', must be tuning, reporting, numbers from 1 to 99 (tuning) or from 1001 "
              "(reporting)");
  return number;
}

}  // namespace

const std::vector<Series>& all_series() {
  static const std::vector<Series> all = make_series();
  return all;
}

std::vector<Series> series_named(const std::vector<std::string>& names) {
  std::vector<Series> chosen;
  std::string known = "all";
  for (const Series& series : all_series()) known += ", " + series.name;
  for (const std::string& name : names) {
    if (name == "all") return all_series();
    const auto found = std::find_if(all_series().begin(), all_series().end(),
                                    [&](const Series& series) { return series.name == name; });
    require(found != all_series().end(),
            "series: no series is called '" + name + "', there are " + known);
    chosen.push_back(*found);
  }
  return chosen;
}

std::string file_prefix(const std::string& series, const std::string& setting) {
  std::string prefix = series == "main" ? "" : series + "_" + setting + "_";
  std::replace(prefix.begin(), prefix.end(), ' ', '_');
  return prefix;
}

void print_title(const Series& series, const Setting& setting) {
  std::printf("\nseries %s, setting %s: %s\n", series.name.c_str(), setting.name.c_str(),
              series.what.c_str());
}

void for_each_setting(const std::vector<std::string>& names, const Setup& given, Changes most,
                      const std::function<void(const Setup&, const std::string&)>& measure) {
  const std::vector<Series> chosen = series_named(names);
  std::string fitting;
  for (const Series& series : all_series())
    if (series.changes <= most) fitting += (fitting.empty() ? "" : ", ") + series.name;
  for (const Series& series : chosen)
    require(series.changes <= most, "series: " + series.name +
                                        " changes nothing that is measured here, must be one of " +
                                        fitting);
  for (const Series& series : chosen)
    for (const Setting& setting : series.settings) {
      Setup setup = given;
      setting.change(setup);
      print_title(series, setting);
      measure(setup, file_prefix(series.name, setting.name));
    }
}

std::vector<std::uint64_t> seeds_named(const std::vector<std::string>& words) {
  std::vector<std::uint64_t> seeds;
  for (const std::string& word : words) {
    if (word == "tuning")
      seeds.insert(seeds.end(), {1, 2, 3});
    else if (word == "reporting")
      seeds.insert(seeds.end(), {kFirstReporting, kFirstReporting + 1, kFirstReporting + 2});
    else
      seeds.push_back(number_in(word));
  }
  const auto reports = [](std::uint64_t seed) { return seed >= kFirstReporting; };
  require(std::none_of(seeds.begin(), seeds.end(), reports) ||
              std::all_of(seeds.begin(), seeds.end(), reports),
          "--seeds mixes seeds for tuning (1 to 99) with seeds for reporting (from 1001), must be "
          "of one kind");
  return seeds;
}

}  // namespace meniscus::accuracy
