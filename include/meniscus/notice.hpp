// What there is to say about a frame, or why there is none: a code and numbers for programs, and a
// line for people.
#pragma once

#include <cstdint>
#include <limits>
#include <string>

#include "meniscus/export.hpp"

namespace meniscus MENISCUS_API {

/// What a notice or an error is about, and which of its numbers say what. Numbers that are not
/// named here are not set.
enum class Code {
  other,  // the text alone tells

  // Of particles:
  not_finite,        // `count` of `of` particles have no finite coordinates; `place`: the first
  coinciding,        // `count` of `of` lie exactly where another one does
  bad_velocities,    // `count` of `of` have none that can be used; `place`: the first
  bad_attribute,     // the same of the attribute `subject`
  bad_radius,        // the radius of particle `place` is `found`, must be > 0
  crowded,           // up to `found` particles lie within `wanted`: `count` of `of` were dropped
  too_far,           // `count` of `of` lie farther than `wanted` particle radii from the others
  coarse_positions,  // positions are rounded to steps of `found`, where `wanted` would do
  no_particles,      // there is none
  none_in_view,      // the camera sees none of `count`
  none_shown,        // no pixel shows one of the `count` in view

  // Of the particle radius (world units):
  radius_estimated,  // from the spacing: `found`
  radius_assumed,    // nothing tells: `found` is taken
  radius_too_small,  // `found`; `wanted` would fit the spacing
  radius_too_large,  // the same
  radius_needed,     // it is not stated, and `count` particles are too many to estimate it

  // Of what the caller gives:
  parameter_out_of_range,  // `subject` is `found`; `wanted`: the end of its range that is nearer
  not_whole,               // `subject` is `found`, must be a whole number
  unknown_parameter,       // `subject` is not the name of one; the text names the nearest
  unknown_map,             // `subject` is not the name of one
  unknown_method,          // `subject` is not the name of one
  memory_too_small,        // `found` bytes, must be at least `wanted`

  // Of files:
  missing_file,  // there is none of the name `subject`

  extracted_again,  // in smaller parts, after the device ran out of memory
};

/// The code's name: "not_finite".
const char* to_string(Code code);

/// One thing to say. Particles are counted from 0.
struct Notice {
  Code code = Code::other;
  std::string text;  // one line: where, what was found, what was wanted, what to do. Settings are
                     // marked by setting(), since each front end has its own way to give them
  std::string subject = {};
  std::int64_t place = -1;  // of a particle
  std::int64_t count = 0, of = 0;
  double found = std::numeric_limits<double>::quiet_NaN();
  double wanted = std::numeric_limits<double>::quiet_NaN();
};

/// A setting's name as it stands in a notice's text: "particle-radius".
std::string setting(const std::string& name);

/// The text with every setting that it names as `named` says: "particle-radius" ->
/// "--particle-radius".
std::string worded(const std::string& text, std::string (*named)(const std::string& setting));

/// The text as C++ and Python call the settings: particle_radius.
std::string to_string(const Notice& notice);

}  // namespace MENISCUS_API
