#include "io/array_bag.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/comma_separated.hpp"

namespace meniscus {
namespace {

std::string list_of(const std::vector<BagArray>& arrays) {
  constexpr std::size_t kMost = 20;
  std::string names;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    if (k == kMost) return names + ", ...";
    names += (k > 0 ? ", " : "") + shown(arrays[k].data.name) + " (" +
             std::to_string(arrays[k].rows) + " x " + std::to_string(arrays[k].data.components) +
             ")";
  }
  return names.empty() ? "no arrays of numbers" : names;
}

}  // namespace

bool is_position(const std::string& given) {
  const std::string name = lower_case(given);
  for (const char* known : {"points", "point", "positions", "position", "pos", "posd", "p",
                            "coordinates", "coords", "xyz", "x", "r", "vertices", "particles"})
    if (name == known) return true;
  return false;
}

bool has_use(const std::string& given) {
  const std::string name = lower_case(given);
  for (const char* known : {"y", "z", "vx", "vy", "vz", "u", "v", "w"})
    if (name == known) return true;
  return is_position(name) || field_of_attribute(name, 3) != Field::none ||
         field_of_attribute(name, 1) != Field::none;
}

void refuse_shape(const Bytes& file, const std::string& place, const std::string& name,
                  const std::vector<std::uint64_t>& shape) {
  constexpr std::uint64_t kMostNumbers = 16;  // of a particle
  if (!is_position(name) || shape.size() < 2) return;
  const bool transposed =
      shape.size() == 2 && shape[0] > 1 && shape[0] <= kMostNumbers && shape[1] > kMostNumbers;
  const bool deep = std::any_of(shape.begin() + 1, shape.end() - 1,
                                [](std::uint64_t length) { return length != 1; });
  if (!transposed && !deep) return;
  const auto text_of = [](std::uint64_t length) { return std::to_string(length); };
  fail(file, place,
       "has shape (" + comma_separated(shape, text_of) + "), wanted (n, 3)" +
           (transposed ? ": transposed?" : " (give each frame a file of its own)"));
}

bool may_unpack_to(std::uint64_t packed, std::uint64_t unpacked) {
  constexpr std::uint64_t kAlways = std::uint64_t{16} << 20;
  return unpacked <= kAlways || unpacked / kMostUnpacked <= packed;
}

void check_unpacked(const Bytes& file, std::uint64_t unpacked, const std::string& place) {
  if (!may_unpack_to(file.size(), unpacked))
    fail(file, place,
         "states that it has " + std::to_string(unpacked) + " bytes, more than " +
             std::to_string(kMostUnpacked) + " times the file's size, wanted particles");
}

namespace {

// The rows of x, y and z where each is an array of its own.
std::optional<std::uint64_t> rows_of_separate(const Bytes& file,
                                              const std::vector<BagArray>& arrays) {
  std::vector<std::string> names;
  for (const BagArray& array : arrays)
    names.push_back(array.data.components == 1 ? array.data.name : "");
  const std::vector<Field> fields = fields_of_columns(names);
  if (!missing_coordinate(fields).empty()) return {};
  const auto rows_of = [&](Field field) {
    const auto found = std::find(fields.begin(), fields.end(), field);
    return arrays[static_cast<std::size_t>(found - fields.begin())].rows;
  };
  const std::uint64_t x = rows_of(Field::x), y = rows_of(Field::y), z = rows_of(Field::z);
  if (y != x || z != x)
    fail(file, "",
         "x, y and z have " + std::to_string(x) + ", " + std::to_string(y) + " and " +
             std::to_string(z) + " values, wanted as many of each");
  return x;
}

struct Positions {
  std::size_t array;   // kSeparate: x, y and z are three arrays
  std::uint64_t rows;  // particles
};

// `dataset`, the first array that is named as positions, x, y and z, or the only wide one.
Positions find_positions(const Bytes& file, const std::vector<BagArray>& arrays,
                         const std::string& dataset) {
  const auto first = [&](const auto& fits) {
    return static_cast<std::size_t>(std::find_if(arrays.begin(), arrays.end(), fits) -
                                    arrays.begin());
  };
  if (!dataset.empty()) {
    const std::size_t k = first([&](const BagArray& a) { return a.data.name == dataset; });
    if (k == arrays.size())
      fail(file, "", "has no array " + in_quotes(dataset) + ", it has " + list_of(arrays));
    if (arrays[k].data.components < 2)
      fail(file, "", "array " + shown(dataset) + " has one component, wanted three: positions");
    return {k, arrays[k].rows};
  }
  const std::size_t named = first([](const BagArray& a) {
    return (a.data.components == 2 || a.data.components == 3) && is_position(a.data.name);
  });
  if (named < arrays.size()) return {named, arrays[named].rows};
  if (const auto rows = rows_of_separate(file, arrays)) return {kSeparate, *rows};
  const auto is_wide = [](const BagArray& a) {  // and of no use but that
    return a.data.components >= 3 &&
           field_of_attribute(a.data.name, a.data.components) == Field::none;
  };
  if (std::count_if(arrays.begin(), arrays.end(), is_wide) != 1)
    fail(file, "",
         "no array is named as positions (give " + setting("dataset") + "), it has " +
             list_of(arrays));
  const std::size_t wide = first(is_wide);
  return {wide, arrays[wide].rows};
}

// Velocities that are not named as such. `at`: the array of positions, or kSeparate.
void add_velocities(std::vector<DataArray>& arrays, std::size_t at) {
  // Six columns without names are positions and velocities, as in .xyz.
  if (at != kSeparate && arrays[at].components == 6) {
    DataArray velocity = arrays[at];
    velocity.name = "velocity";
    velocity.components = 3;
    velocity.offset += 3 * velocity.component_stride;
    arrays.push_back(std::move(velocity));
  }
  // PySPH and others call velocities u, v and w.
  const auto named = [&](const char* name) {
    return std::find_if(arrays.begin(), arrays.end(), [&](const DataArray& array) {
      return array.components == 1 && lower_case(array.name) == name;
    });
  };
  const bool has_velocity = std::any_of(arrays.begin(), arrays.end(), [](const DataArray& array) {
    return field_of_attribute(array.name, array.components) == Field::vx ||
           lower_case(array.name) == "vx";
  });
  if (has_velocity || named("u") == arrays.end() || named("v") == arrays.end() ||
      named("w") == arrays.end())
    return;
  for (const auto& [from, to] : {std::pair{"u", "vx"}, {"v", "vy"}, {"w", "vz"}}) {
    DataArray copy = *named(from);
    copy.name = to;
    arrays.push_back(std::move(copy));
  }
}

}  // namespace

Layout layout_of_bag(const Bytes& file, std::vector<BagArray> arrays, const std::string& dataset,
                     const ReadOptions& options) {
  const Positions positions = find_positions(file, arrays, dataset);
  std::vector<DataArray> kept;
  std::size_t at = kSeparate;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    if (arrays[k].rows != positions.rows) continue;
    if (k == positions.array) at = kept.size();
    kept.push_back(std::move(arrays[k].data));
  }
  add_velocities(kept, at);
  return layout_of(file, kept, at, static_cast<std::int64_t>(positions.rows), options);
}

}  // namespace meniscus
