#include "io/fields.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>

#include "io/input_file.hpp"

namespace meniscus {
namespace {

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_velocity(std::string_view name) {
  return is_one_of(name, {"velocity", "velocities", "vel", "v"});
}

Field scalar_field(std::string_view name) {
  if (is_one_of(name, {"density", "densities", "rho", "rhop"})) return Field::density;
  if (is_one_of(name, {"radius", "radii", "pscale"})) return Field::radius;
  if (is_one_of(name, {"id", "ids", "idp", "particle_id", "particleid", "gid"})) return Field::id;
  return Field::none;
}

Field component(Field first, std::size_t k) {
  return static_cast<Field>(static_cast<std::size_t>(first) + k);
}

Field field_of_column(std::string_view given) {
  const std::string name = without_unit(given);
  if (name.empty()) return Field::none;

  const std::size_t letter = std::string_view("xyz").find(name.back());
  const std::size_t digit = std::string_view("012").find(name.back());
  const bool is_letter = letter != std::string_view::npos;
  if (is_letter || digit != std::string_view::npos) {
    const std::size_t k = is_letter ? letter : digit;
    std::string_view stem = std::string_view(name).substr(0, name.size() - 1);
    if (stem.empty() && is_letter) return component(Field::x, k);
    const bool separated =
        !stem.empty() && is_one_of(stem.substr(stem.size() - 1), {":", "_", ".", " "});
    if (separated) stem.remove_suffix(1);
    if (separated && is_one_of(stem, {"points", "position", "pos", "p"}))
      return component(Field::x, k);
    if ((separated || is_letter) && is_velocity(stem)) return component(Field::vx, k);
  }
  return scalar_field(name);
}

}  // namespace

std::string without_unit(std::string_view given) {
  std::string name = lower_case(given.substr(0, given.find('[')));
  const std::size_t last = name.find_last_not_of(" \t");
  name.erase(last == std::string::npos ? 0 : last + 1);
  return name;
}

std::vector<Field> fields_of_columns(const std::vector<std::string>& names) {
  std::vector<Field> fields;
  std::array<bool, static_cast<std::size_t>(Field::none) + 1> taken{};
  for (const std::string& name : names) {
    const Field field = field_of_column(name);
    bool& is_taken = taken[static_cast<std::size_t>(field)];
    fields.push_back(is_taken ? Field::none : field);
    is_taken = true;
  }
  const auto has = [&](Field field) {
    return std::find(fields.begin(), fields.end(), field) != fields.end();
  };
  if (!has(Field::vx) || !has(Field::vy) || !has(Field::vz))
    for (Field& field : fields)
      if (field >= Field::vx && field <= Field::vz) field = Field::none;
  return fields;
}

std::string missing_coordinate(const std::vector<Field>& fields) {
  for (std::size_t k = 0; k < 3; ++k)
    if (std::find(fields.begin(), fields.end(), component(Field::x, k)) == fields.end())
      return std::string(1, "xyz"[k]);
  return {};
}

Field field_of_attribute(std::string_view given, std::size_t components) {
  const std::string name = lower_case(given);
  if (components == 3) return is_velocity(name) ? Field::vx : Field::none;
  return components == 1 ? scalar_field(name) : Field::none;
}

std::vector<float>& array_of(Particles& particles, Field field) {
  switch (field) {
    case Field::x:
      return particles.x;
    case Field::y:
      return particles.y;
    case Field::z:
      return particles.z;
    case Field::vx:
      return particles.vx;
    case Field::vy:
      return particles.vy;
    case Field::vz:
      return particles.vz;
    case Field::density:
      return particles.density;
    default:
      return particles.radius;
  }
}

void resize(Particles& particles, const std::vector<Field>& fields, std::size_t n) {
  for (const Field field : fields) {
    if (field == Field::none) continue;
    if (field == Field::id)
      particles.id.resize(n);
    else
      array_of(particles, field).resize(n);
  }
}

}  // namespace meniscus
