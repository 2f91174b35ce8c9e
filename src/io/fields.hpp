// Which array of Particles a column or an attribute of a file belongs to, by its name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "meniscus/types.hpp"

namespace meniscus {

enum class Field { x, y, z, vx, vy, vz, density, radius, id, none };

/// A column's name in lower case, without a unit in [] behind it.
std::string without_unit(std::string_view given);

/// The field of each column of a table. Names match in any case: x, pos.x or Points:0, vx or
/// velocity_x, density or rho, radius or pscale, id; a unit in [] is left out. Where two columns
/// name one field, the first has it; a velocity without all three components is left out.
std::vector<Field> fields_of_columns(const std::vector<std::string>& names);

/// The first of x, y, z that no column names, or an empty string.
std::string missing_coordinate(const std::vector<Field>& fields);

/// The field of an attribute of a point: vx stands for a velocity of three components.
Field field_of_attribute(std::string_view name, std::size_t components);

/// The array of a field other than id and none.
std::vector<float>& array_of(Particles& particles, Field field);

/// Gives the arrays of these fields n entries.
void resize(Particles& particles, const std::vector<Field>& fields, std::size_t n);

}  // namespace meniscus
