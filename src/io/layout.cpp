#include "io/layout.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "base/parallel.hpp"
#include "io/attribute_names.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 18;  // bytes read at a time: fits a cache

// Columns whose values lie in rows of one stride.
struct Rows {
  const Bytes* bytes = nullptr;
  std::uint64_t first = 0, stride = 0;  // of the leftmost column; bytes
  std::size_t width = 0;                // bytes from the leftmost to the end of the rightmost
  std::vector<std::size_t> columns;
};

std::vector<Rows> rows_of(const Layout& layout, const std::vector<std::size_t>& wanted) {
  std::vector<Rows> all;
  for (const std::size_t k : wanted) {
    const Layout::Column& column = layout.columns[k];
    const std::uint64_t end = column.offset + size_of(column.type);
    const auto fits = [&](const Rows& rows) {
      const std::uint64_t first = std::min(rows.first, column.offset);
      return rows.bytes == column.bytes.get() && rows.stride == column.stride &&
             std::max(rows.first + rows.width, end) - first <= rows.stride;
    };
    const auto found = std::find_if(all.begin(), all.end(), fits);
    if (found == all.end()) {
      all.push_back({column.bytes.get(), column.offset, column.stride, size_of(column.type), {k}});
      continue;
    }
    const std::uint64_t last = std::max(found->first + found->width, end);
    found->first = std::min(found->first, column.offset);
    found->width = static_cast<std::size_t>(last - found->first);
    found->columns.push_back(k);
  }
  return all;
}

template <std::size_t kStride>
void copy_floats(const char* from, std::size_t count, std::size_t stride, float* to) {
  const std::size_t step = kStride > 0 ? kStride : stride;
  for (std::size_t i = 0; i < count; ++i, from += step) std::memcpy(to + i, from, sizeof(float));
}

// Values `stride` bytes apart.
void unpack(const char* from, std::size_t count, std::size_t stride, const Layout::Column& column,
            float* to) {
  if (column.type == Scalar::float32 && column.order == std::endian::native) {
    if (stride == sizeof(float))
      std::memcpy(to, from, count * sizeof(float));
    else if (stride == 3 * sizeof(float))
      copy_floats<3 * sizeof(float)>(from, count, stride, to);
    else
      copy_floats<0>(from, count, stride, to);
  } else if (column.type == Scalar::float64 && column.order == std::endian::native) {
    for (std::size_t i = 0; i < count; ++i, from += stride) {
      double value;
      std::memcpy(&value, from, sizeof value);
      to[i] = static_cast<float>(value);
    }
  } else {
    for (std::size_t i = 0; i < count; ++i, from += stride)
      to[i] = load_real<float>(from, column.type, column.order);
  }
}

// Calls work(values of the first row, place, count) for the rows from `first` on, block by block.
template <class Work>
void for_each_block(const Rows& rows, std::uint64_t first, std::size_t count, std::string& buffer,
                    const Work& work) {
  const std::size_t stride = static_cast<std::size_t>(rows.stride);
  const std::uint64_t packed = rows.bytes->block();
  for (std::size_t done = 0, now = 0; done < count; done += now) {
    const std::uint64_t at = rows.first + (first + done) * rows.stride;
    // All rows that begin in a large packed block, which each read would unpack again.
    const std::uint64_t wanted =
        packed > kBlock ? (packed - at % packed + stride - 1) / stride : kBlock / stride;
    now =
        static_cast<std::size_t>(std::clamp<std::uint64_t>(wanted, 1, std::uint64_t{count - done}));
    const std::size_t size = (now - 1) * stride + rows.width;
    if (rows.bytes->in_memory()) {
      work(rows.bytes->in_memory() + at, done, now);
    } else {
      buffer.resize(std::max(buffer.size(), size));
      rows.bytes->read(at, buffer.data(), size);
      work(buffer.data(), done, now);
    }
  }
}

float* array_of(const ParticleArrays& to, const Layout::Column& column) {
  switch (column.field) {
    case Field::x:
      return to.x;
    case Field::y:
      return to.y;
    case Field::z:
      return to.z;
    case Field::vx:
      return to.vx;
    case Field::vy:
      return to.vy;
    case Field::vz:
      return to.vz;
    case Field::radius:
      return to.radius;
    case Field::none:
      return column.attribute < to.attributes.size() ? to.attributes[column.attribute] : nullptr;
    default:
      return nullptr;
  }
}

void read_values(const Layout& layout, std::int64_t first, std::size_t count,
                 const ParticleArrays& to) {
  std::vector<std::size_t> wanted;
  for (std::size_t k = 0; k < layout.columns.size(); ++k)
    if (array_of(to, layout.columns[k])) wanted.push_back(k);
  std::string buffer;
  for (const Rows& rows : rows_of(layout, wanted))
    for_each_block(rows, static_cast<std::uint64_t>(first), count, buffer,
                   [&](const char* from, std::size_t place, std::size_t now) {
                     for (const std::size_t k : rows.columns) {
                       const Layout::Column& column = layout.columns[k];
                       unpack(from + (column.offset - rows.first), now,
                              static_cast<std::size_t>(rows.stride), column,
                              array_of(to, column) + place);
                     }
                   });
}

void read_ids(const Bytes& file, const Layout& layout, std::size_t k,
              std::vector<std::int64_t>& ids) {
  const Layout::Column& column = layout.columns[k];
  ids.resize(static_cast<std::size_t>(layout.count));
  std::string buffer;
  for (const Rows& rows : rows_of(layout, {k}))
    for_each_block(rows, 0, ids.size(), buffer,
                   [&](const char* from, std::size_t place, std::size_t now) {
                     for (std::size_t i = 0; i < now; ++i, from += rows.stride) {
                       const auto id = load_integer(from, column.type, column.order);
                       if (!id)
                         fail(file, layout.item + " " + std::to_string(place + i),
                              "id is " + shown(load_real<double>(from, column.type, column.order)) +
                                  ", must be a whole number of 64 bits");
                       ids[place + i] = *id;
                     }
                   });
}

class LayoutSource : public ParticleSource {
 public:
  LayoutSource(std::shared_ptr<const Bytes> file, Layout layout)
      : file_(std::move(file)), layout_(std::move(layout)) {}
  std::int64_t size() const override { return layout_.count; }
  bool has_radius() const override { return has(Field::radius); }
  bool has_velocity() const override { return has(Field::vx); }
  double particle_radius() const override { return layout_.particle_radius; }
  std::vector<std::string> attributes() const override { return layout_.attributes; }
  std::string name(std::int64_t particle) const override {
    return layout_.item + " " + std::to_string(particle);
  }
  void read(std::int64_t first, std::size_t count, const ParticleArrays& to) const override {
    if (to.z && !has(Field::z)) std::fill_n(to.z, count, 0.0f);  // a plane
    read_values(layout_, first, count, to);
  }

 private:
  bool has(Field field) const {
    return std::any_of(layout_.columns.begin(), layout_.columns.end(),
                       [&](const Layout::Column& column) { return column.field == field; });
  }
  std::shared_ptr<const Bytes> file_;
  Layout layout_;
};

// Fails unless the array holds `count` particles: what a header states is not believed before
// memory is taken for it.
void check_room(const Bytes& file, const DataArray& array, std::uint64_t count) {
  if (count == 0) return;
  const auto product = [&](std::uint64_t a, std::uint64_t b) {
    std::uint64_t result = 0;
    if (__builtin_mul_overflow(a, b, &result))
      fail(file, "", "the size of " + shown(array.name) + " is too large");
    return result;
  };
  const std::uint64_t spread = product(count - 1, array.stride);
  const std::uint64_t width = product(array.components - 1, array.component_stride);
  std::uint64_t end = 0;
  if (__builtin_add_overflow(spread, width, &end) ||
      __builtin_add_overflow(end, array.offset + size_of(array.type), &end) || end < array.offset ||
      end > array.bytes->size())
    fail(file, "",
         "its data has " + std::to_string(array.bytes->size()) + " bytes, wanted " +
             std::to_string(count) + " x " + std::to_string(array.components) + " values of " +
             shown(array.name) + " of " + std::to_string(size_of(array.type)) +
             " bytes from byte " + std::to_string(array.offset) + " (truncated?)");
}

}  // namespace

Layout layout_of(const Bytes& file, const std::vector<DataArray>& arrays, std::size_t positions,
                 std::int64_t count, const ReadOptions& options) {
  Layout layout;
  layout.count = count;
  const auto add = [&](const DataArray& array, std::size_t component, Field field,
                       std::size_t attribute) {
    check_room(file, array, static_cast<std::uint64_t>(count));
    layout.columns.push_back({field, attribute, array.name, array.type, array.order, array.bytes,
                              array.offset + component * array.component_stride, array.stride});
  };
  const auto add_three = [&](const DataArray& array, Field first) {
    for (std::size_t k = 0; k < std::min<std::size_t>(array.components, 3); ++k)
      add(array, k, static_cast<Field>(static_cast<std::size_t>(first) + k), 0);
  };
  std::array<bool, static_cast<std::size_t>(Field::none) + 1> taken{};
  const auto take = [&](Field field) {
    const bool is_new = field != Field::none && !taken[static_cast<std::size_t>(field)];
    taken[static_cast<std::size_t>(field)] = true;
    return is_new;
  };
  if (positions != kSeparate) add_three(arrays[positions], Field::x);
  // Whole vectors first, then what columns of a table would be called.
  std::vector<std::string> names;
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    const bool single = arrays[k].components == 1 && k != positions;
    names.push_back(single ? arrays[k].name : "");
    if (arrays[k].components == 3 && k != positions &&
        field_of_attribute(arrays[k].name, 3) == Field::vx && take(Field::vx))
      add_three(arrays[k], Field::vx);
  }
  const std::vector<Field> fields = fields_of_columns(names);
  const bool vector_velocity = taken[static_cast<std::size_t>(Field::vx)];
  for (std::size_t k = 0; k < arrays.size(); ++k) {
    const Field field = fields[k];
    if (field == Field::none || (positions != kSeparate && field <= Field::z) ||
        (vector_velocity && field >= Field::vx && field <= Field::vz) || !take(field))
      continue;
    if (field == Field::radius && options.particle_radius > 0) continue;
    add(arrays[k], 0, field, 0);
  }
  if (positions == kSeparate) {
    if (const std::string missing = missing_coordinate(fields); !missing.empty())
      fail(file, "", "has no array for " + missing + ", it has " + listed(arrays));
  }
  std::vector<NamedArray> named;
  for (const DataArray& array : arrays) named.push_back({array.name, array.components});
  for (const AttributePick& pick : pick_attributes(file.name(), named, options.attributes)) {
    add(arrays[pick.array], pick.component, Field::none, layout.attributes.size());
    layout.attributes.push_back(pick.name);
  }
  layout.particle_radius = options.particle_radius;
  return layout;
}

Particles read_layout(const Bytes& file, const Layout& layout) {
  Particles particles;
  particles.particle_radius = layout.particle_radius;
  particles.time = layout.time;
  const auto count = static_cast<std::size_t>(layout.count);
  std::vector<Field> fields;
  for (const Layout::Column& column : layout.columns)
    if (column.field != Field::id) fields.push_back(column.field);
  resize(particles, fields, count);
  for (std::vector<float>* axis : {&particles.x, &particles.y, &particles.z})
    axis->resize(count);  // a plane has no z
  for (const std::string& name : layout.attributes)
    particles.attributes.push_back({name, std::vector<float>(count)});
  const auto at = [](std::vector<float>& values) {
    return values.empty() ? nullptr : values.data();
  };
  ParticleArrays to{at(particles.x),  at(particles.y),  at(particles.z),     at(particles.vx),
                    at(particles.vy), at(particles.vz), at(particles.radius)};
  for (Attribute& attribute : particles.attributes)
    to.attributes.push_back(attribute.values.data());
  if (count > 0) {
    constexpr std::size_t kGrain = std::size_t{1} << 19;  // particles that are worth a thread
    parallel_for(count, kGrain, [&](std::size_t begin, std::size_t end) {
      read_values(layout, static_cast<std::int64_t>(begin), end - begin, to.from(begin));
    });
    for (std::size_t k = 0; k < layout.columns.size(); ++k) {
      if (layout.columns[k].field == Field::id) read_ids(file, layout, k, particles.id);
      if (layout.columns[k].field != Field::density) continue;
      Layout alone = layout;
      alone.columns = {layout.columns[k]};
      alone.columns[0].field = Field::x;
      read_values(alone, 0, count, {.x = particles.density.data()});
    }
  }
  return particles;
}

bool is_on_disk(const Layout& layout) {
  return std::none_of(layout.columns.begin(), layout.columns.end(),
                      [](const Layout::Column& column) { return column.bytes->in_memory(); });
}

ParticleArrays ParticleArrays::from(std::size_t place) const {
  const auto at = [&](float* values) { return values ? values + place : nullptr; };
  ParticleArrays moved{at(x), at(y), at(z), at(vx), at(vy), at(vz), at(radius)};
  for (float* values : attributes) moved.attributes.push_back(at(values));
  return moved;
}

std::unique_ptr<ParticleSource> source_of(std::shared_ptr<const Bytes> file, Layout layout) {
  return std::make_unique<LayoutSource>(std::move(file), std::move(layout));
}

}  // namespace meniscus
