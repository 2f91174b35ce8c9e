// Attributes of particles on their way to the surface.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "base/notices.hpp"
#include "device/device.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/types.hpp"
#include "prepare/usable.hpp"
#include "stages/extras/motion.hpp"

namespace meniscus {

/// Of a particle whose own attribute cannot be used: it gets the mean of those around it.
inline constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

class ValueCheck : public UsableCheck {
 public:
  /// The value of the particle `place` of the file, or kNoValue where it cannot be used.
  float checked(float value, std::int64_t place) { return usable(place, value) ? value : kNoValue; }

  /// Warns if there were any. Throws InputError when params.strict.
  void report(const std::string& attribute, const Parameters& params, Notices& notices) const;
};

/// Throws InvalidArgument where two attributes have one name, or one has none.
void check_names(const std::vector<std::string>& names);

/// Attributes as velocities, which motion.hpp weighs: three in one where every particle has a value
/// of each, else one.
struct AttributeTriple {
  std::size_t first = 0, count = 0;  // which attributes
  std::vector<Vec3> values;          // [particles] or kNoVelocity
};
std::vector<AttributeTriple> triples_of(const std::vector<Attribute>& attributes);

/// Adds the attributes of a triple to those of the surface, from what motion.hpp made of it.
void add_attributes(const AttributeTriple& triple, const std::vector<Attribute>& attributes,
                    const std::vector<Vec3>& weighed, std::vector<Attribute>& to);

}  // namespace meniscus
