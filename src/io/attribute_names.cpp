#include "io/attribute_names.hpp"

#include <algorithm>

namespace meniscus {
namespace {

std::string listed(const std::vector<NamedArray>& arrays) {
  constexpr std::size_t kLongest = 300;  // characters
  std::string names;
  for (const NamedArray& array : arrays) {
    if (names.size() > kLongest) return names + ", ...";
    names += (names.empty() ? "" : ", ") + shown(array.name);
  }
  return names.empty() ? "none" : names;
}

}  // namespace

std::string component_name(const std::string& name, std::size_t component, std::size_t components) {
  if (components == 1) return name;
  return name + "." +
         (components == 3 ? std::string(1, "XYZ"[component]) : std::to_string(component));
}

std::vector<AttributePick> pick_attributes(const std::string& file,
                                           const std::vector<NamedArray>& arrays,
                                           const std::vector<std::string>& asked) {
  std::vector<AttributePick> picks;
  for (const std::string& name : asked) {
    const std::string wanted = lower_case(name);
    const auto find = [&](const std::string& what) {
      return std::find_if(arrays.begin(), arrays.end(), [&](const NamedArray& array) {
        return lower_case(array.name) == what || without_unit(array.name) == what;
      });
    };
    if (const auto found = find(wanted); found != arrays.end()) {
      for (std::size_t k = 0; k < found->components; ++k)
        picks.push_back({static_cast<std::size_t>(found - arrays.begin()), k,
                         component_name(name, k, found->components)});
      continue;
    }
    std::vector<AttributePick> three;
    for (const char separator : {':', '_', '.'})
      for (const char* letters : {"xyz", "012"}) {
        if (!three.empty()) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          const auto found = find(wanted + separator + letters[k]);
          if (found == arrays.end() || found->components != 1) break;
          three.push_back(
              {static_cast<std::size_t>(found - arrays.begin()), 0, component_name(name, k, 3)});
        }
        if (three.size() < 3) three.clear();
      }
    if (three.empty())
      throw InputError(file + ": has no attribute " + in_quotes(name) + ", it has " +
                       listed(arrays));
    picks.insert(picks.end(), three.begin(), three.end());
  }
  return picks;
}

std::vector<AttributePick> pick_attributes(const std::string& file,
                                           const std::vector<std::string>& columns,
                                           const std::vector<std::string>& asked) {
  std::vector<NamedArray> arrays;
  for (const std::string& name : columns) arrays.push_back({name, 1});
  return pick_attributes(file, arrays, asked);
}

std::string listed(const std::vector<DataArray>& arrays) {
  std::vector<NamedArray> named;
  for (const DataArray& array : arrays) named.push_back({array.name, array.components});
  return listed(named);
}

}  // namespace meniscus
