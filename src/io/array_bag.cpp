#include "io/array_bag.hpp"

#include <algorithm>
#include <array>

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
      shape.size() == 2 && (shape[0] == 2 || shape[0] == 3) && shape[1] > kMostNumbers;
  const bool deep = std::any_of(shape.begin() + 1, shape.end() - 1,
                                [](std::uint64_t length) { return length != 1; });
  if (!transposed && !deep) return;
  std::string found;
  for (const std::uint64_t length : shape)
    found += (found.empty() ? "" : ", ") + std::to_string(length);
  fail(file, place,
       "has shape (" + found + "), wanted (n, 3)" +
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

Layout layout_of_bag(const Bytes& file, std::vector<BagArray> arrays, const std::string& dataset,
                     const ReadOptions& options) {
  const auto width_fits = [](const BagArray& array) {
    return array.data.components == 2 || array.data.components == 3;
  };
  std::size_t positions = arrays.size();
  for (std::size_t k = 0; k < arrays.size() && positions == arrays.size(); ++k)
    if (!dataset.empty() && arrays[k].data.name == dataset) positions = k;
  if (positions < arrays.size() && arrays[positions].data.components < 2)
    fail(file, "", "array " + shown(dataset) + " has one component, wanted three: positions");
  if (!dataset.empty() && positions == arrays.size())
    fail(file, "", "has no array " + in_quotes(dataset) + ", it has " + list_of(arrays));
  for (std::size_t k = 0; k < arrays.size() && positions == arrays.size(); ++k)
    if (width_fits(arrays[k]) && is_position(arrays[k].data.name)) positions = k;
  std::uint64_t rows = 0;
  if (positions < arrays.size()) {
    rows = arrays[positions].rows;
  } else {
    std::vector<std::string> names;
    for (const BagArray& array : arrays)
      names.push_back(array.data.components == 1 ? array.data.name : "");
    const std::vector<Field> fields = fields_of_columns(names);
    if (missing_coordinate(fields).empty()) {
      const auto rows_of = [&](Field field) {
        return arrays[static_cast<std::size_t>(std::find(fields.begin(), fields.end(), field) -
                                               fields.begin())]
            .rows;
      };
      rows = rows_of(Field::x);
      if (rows_of(Field::y) != rows || rows_of(Field::z) != rows)
        fail(file, "",
             "x, y and z have " + std::to_string(rows) + ", " + std::to_string(rows_of(Field::y)) +
                 " and " + std::to_string(rows_of(Field::z)) + " values, wanted as many of each");
      positions = kSeparate;
    } else {
      std::vector<std::size_t> wide;
      for (std::size_t k = 0; k < arrays.size(); ++k)
        if (arrays[k].data.components >= 3) wide.push_back(k);
      if (wide.size() != 1)
        fail(file, "",
             "no array is named as positions (give " + setting("dataset") + "), it has " +
                 list_of(arrays));
      positions = wide[0];
      rows = arrays[positions].rows;
    }
  }
  std::vector<DataArray> kept;
  std::size_t at = kSeparate;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    if (arrays[k].rows != rows) continue;
    if (k == positions) at = kept.size();
    kept.push_back(std::move(arrays[k].data));
  }
  // Six columns without names are positions and velocities, as in .xyz.
  if (at != kSeparate && kept[at].components == 6) {
    DataArray velocity = kept[at];
    velocity.name = "velocity";
    velocity.components = 3;
    velocity.offset += 3 * velocity.component_stride;
    kept.push_back(std::move(velocity));
  }
  // PySPH and others call velocities u, v and w.
  const auto named = [&](const char* name) {
    return std::find_if(kept.begin(), kept.end(), [&](const DataArray& array) {
      return array.components == 1 && lower_case(array.name) == name;
    });
  };
  const bool has_velocity = std::any_of(kept.begin(), kept.end(), [](const DataArray& array) {
    return field_of_attribute(array.name, array.components) == Field::vx ||
           lower_case(array.name) == "vx";
  });
  if (!has_velocity && named("u") != kept.end() && named("v") != kept.end() &&
      named("w") != kept.end()) {
    const std::array<std::pair<const char*, const char*>, 3> names{
        {{"u", "vx"}, {"v", "vy"}, {"w", "vz"}}};
    for (const auto& [from, to] : names) {
      DataArray copy = *named(from);
      copy.name = to;
      kept.push_back(std::move(copy));
    }
  }
  return layout_of(file, kept, at, static_cast<std::int64_t>(rows), options);
}

}  // namespace meniscus
