#include "prepare/attributes.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "meniscus/error.hpp"
#include "prepare/velocities.hpp"

namespace meniscus {

void ValueCheck::report(const std::string& attribute, const Parameters& params,
                        Notices& notices) const {
  UsableCheck::report({.code = Code::bad_attribute,
                       .text = attribute + " is NaN, infinite or absurd in " +
                               std::to_string(bad_) + " of " + std::to_string(seen_) + " particles",
                       .subject = attribute},
                      params, notices);
}

void check_names(const std::vector<std::string>& names) {
  std::set<std::string> seen;
  for (const std::string& name : names)
    require(!name.empty() && seen.insert(name).second,
            name.empty() ? "particles: an attribute has no name"
                         : "particles: two attributes are named " + name);
}

std::vector<AttributeTriple> triples_of(const std::vector<Attribute>& attributes) {
  constexpr std::size_t kMost = 3;
  const auto is_whole = [](const Attribute& attribute) {
    return std::none_of(attribute.values.begin(), attribute.values.end(),
                        [](float value) { return std::isnan(value); });
  };
  std::vector<AttributeTriple> triples;
  for (std::size_t k = 0; k < attributes.size();) {
    AttributeTriple triple{k, 1, {}};
    bool whole = is_whole(attributes[k]);
    while (whole && triple.count < kMost && k + triple.count < attributes.size() &&
           is_whole(attributes[k + triple.count]))
      ++triple.count;
    const auto value = [&](std::size_t a, std::size_t i) {
      return a < triple.count ? attributes[k + a].values[i] : 0.0f;
    };
    for (std::size_t i = 0; i < attributes[k].values.size(); ++i)
      triple.values.push_back(std::isnan(attributes[k].values[i])
                                  ? kNoVelocity
                                  : Vec3{value(0, i), value(1, i), value(2, i)});
    k += triple.count;
    triples.push_back(std::move(triple));
  }
  return triples;
}

void add_attributes(const AttributeTriple& triple, const std::vector<Attribute>& attributes,
                    const std::vector<Vec3>& weighed, std::vector<Attribute>& to) {
  for (std::size_t a = 0; a < triple.count; ++a) {
    Attribute attribute{attributes[triple.first + a].name, {}};
    attribute.values.reserve(weighed.size());
    for (const Vec3& value : weighed)
      attribute.values.push_back(a == 0 ? value.x : a == 1 ? value.y : value.z);
    to.push_back(std::move(attribute));
  }
}

}  // namespace meniscus
