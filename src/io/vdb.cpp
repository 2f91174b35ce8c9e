// OpenVDB's grids of points, read by OpenVDB. It stores a point as the voxel it is in and its place
// there, so that positions are made here: index to world by the grid's transform.
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cmath>
#include <istream>
#include <optional>
#include <streambuf>
#include <string>
#include <type_traits>
#include <vector>

#include "base/comma_separated.hpp"
#include "base/printable.hpp"
#include "io/array_bag.hpp"
#include "io/attribute_names.hpp"
#include "io/fields.hpp"
#include "io/readers.hpp"

namespace meniscus {
namespace {

using openvdb::Index;
using openvdb::points::AttributeArray;
using openvdb::points::AttributeHandle;
using openvdb::points::AttributeSet;
using openvdb::points::PointDataGrid;
using PointLeaf = PointDataGrid::TreeType::LeafNodeType;

constexpr char kMagic[] = {' ', 'B', 'D', 'V', 0, 0, 0, 0};

/// A file in memory for a stream, without a copy. What is behind its end cannot be sought.
class Buffer : public std::streambuf {
 public:
  explicit Buffer(const std::string& bytes) {
    char* const first = const_cast<char*>(bytes.data());
    setg(first, first, first + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                   std::ios_base::openmode which) override {
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    return seekpos(base + offset, which);
  }
  pos_type seekpos(pos_type to, std::ios_base::openmode which) override {
    const off_type at = to;
    if (!(which & std::ios_base::in) || at < 0 || at > egptr() - eback()) return off_type{-1};
    setg(eback(), eback() + at, egptr());
    return to;
  }
};

/// Calls visit(T()) with the type of that name; false where points of it are no numbers.
template <class Visit>
bool visit_type(const openvdb::Name& name, Visit visit) {
  const auto is = [&]<class T>(T value) {
    if (name != openvdb::typeNameAsString<T>()) return false;
    visit(value);
    return true;
  };
  return is(float{}) || is(openvdb::Vec3f{}) || is(std::int32_t{}) || is(std::int64_t{}) ||
         is(double{}) || is(openvdb::Vec3d{}) || is(openvdb::Vec3i{}) || is(bool{}) ||
         is(std::int8_t{}) || is(std::int16_t{});
}

template <class T>
constexpr bool kIsVector = openvdb::VecTraits<T>::IsVec;

/// Numbers of a point: a vector's components, else as many as the array has for each.
std::size_t components_of(const AttributeArray& array) {
  std::size_t components = 0;
  visit_type(array.valueType(), [&](auto value) {
    if (!kIsVector<decltype(value)>)
      components = array.stride();
    else if (array.stride() == 1)
      components = 3;
  });
  return components;
}

/// Calls take(i, number) for a component of each point of a leaf, in the array's own type.
template <class Take>
void each_value(const AttributeArray& array, std::size_t component, Take take) {
  visit_type(array.valueType(), [&](auto type) {
    using T = decltype(type);
    const AttributeHandle<T> handle(array);
    for (Index i = 0; i < handle.size(); ++i) {
      if constexpr (kIsVector<T>)
        take(i, handle.get(i)[static_cast<int>(component)]);
      else
        take(i, handle.get(i, static_cast<Index>(component)));
    }
  });
}

std::string list_of(const std::vector<openvdb::GridBase::Ptr>& grids) {
  return grids.empty() ? "none" : comma_separated(grids, [](const auto& grid) {
    return in_quotes(grid->getName()) + " (" + shown(grid->valueType()) + ")";
  });
}

/// The grid of points that `dataset` names, or the only one.
PointDataGrid::ConstPtr points_of(const InputFile& file, const std::string& dataset) {
  Buffer buffer(file.bytes);
  std::istream stream(&buffer);
  stream.exceptions(std::ios_base::failbit | std::ios_base::badbit);  // where the file ends
  const auto grids = openvdb::io::Stream(stream, false).getGrids();
  std::vector<openvdb::GridBase::Ptr> all;
  std::vector<PointDataGrid::ConstPtr> found;
  for (const auto& grid : *grids) {
    if (!grid) continue;
    all.push_back(grid);
    if (!dataset.empty() && grid->getName() != dataset) continue;
    if (const auto points = openvdb::gridConstPtrCast<PointDataGrid>(grid)) found.push_back(points);
  }
  if (found.size() == 1) return found[0];
  fail(file, "",
       "has " + std::string(found.empty() ? "no grid" : "several grids") + " of points" +
           (dataset.empty() ? "" : " called " + in_quotes(dataset)) + ", wanted one" +
           (found.empty() || !dataset.empty() ? "" : " (give " + setting("dataset") + ")") +
           "; its grids are " + list_of(all));
}

/// Writes the world positions of a leaf's points from `at` on.
void read_positions(const PointLeaf& leaf, const AttributeArray& array,
                    const openvdb::math::Transform& transform, std::size_t at,
                    Particles& particles) {
  const AttributeHandle<openvdb::Vec3f> places(array);
  Index i = 0;
  for (Index voxel = 0; voxel < PointLeaf::SIZE; ++voxel) {
    const openvdb::Vec3d centre = leaf.offsetToGlobalCoord(voxel).asVec3d();
    for (const Index end = static_cast<Index>(leaf.getValue(voxel)); i < end; ++i, ++at) {
      const openvdb::Vec3d world = transform.indexToWorld(centre + places.get(i));
      particles.x[at] = static_cast<float>(world.x());
      particles.y[at] = static_cast<float>(world.y());
      particles.z[at] = static_cast<float>(world.z());
    }
  }
}

/// Where a component of an attribute goes.
struct Column {
  Field field;
  std::size_t position, component;  // of the attribute in the set; of a point
  std::vector<float>* values;       // null: ids
};

/// What is read of the attributes beside the positions; makes room for it.
std::vector<Column> columns_for(const InputFile& file, const AttributeSet& attributes,
                                const ReadOptions& options, std::size_t count,
                                Particles& particles) {
  std::vector<NamedArray> named;
  std::vector<std::size_t> positions;  // of each
  for (const auto& [name, position] : attributes.descriptor().map()) {
    const std::size_t components = components_of(*attributes.getConst(position));
    if (name == "P" || components == 0) continue;
    named.push_back({name, components});
    positions.push_back(position);
  }
  std::vector<Column> columns;
  for (std::size_t k = 0; k < named.size(); ++k) {
    const Field first = field_of_attribute(named[k].name, named[k].components);
    const auto same = [&](const Column& other) { return other.field == first; };
    if (first == Field::none || std::any_of(columns.begin(), columns.end(), same)) continue;
    for (std::size_t c = 0; c < named[k].components; ++c) {
      const Field field = static_cast<Field>(static_cast<std::size_t>(first) + c);
      resize(particles, {field}, count);
      columns.push_back(
          {field, positions[k], c, field == Field::id ? nullptr : &array_of(particles, field)});
    }
  }
  const auto picks = pick_attributes(file.name, named, options.attributes);
  for (const AttributePick& pick : picks)
    particles.attributes.push_back({pick.name, std::vector<float>(count)});
  for (std::size_t k = 0; k < picks.size(); ++k)
    columns.push_back({Field::none, positions[picks[k].array], picks[k].component,
                       &particles.attributes[k].values});
  return columns;
}

/// The whole number that an id is; none where it is another one.
template <class T>
std::optional<std::int64_t> id_of(T value) {
  const auto number = static_cast<double>(value);
  if (std::is_floating_point_v<T> && !(std::abs(number) < 0x1p63 && number == std::trunc(number)))
    return std::nullopt;
  return static_cast<std::int64_t>(value);
}

Particles read_grid(const InputFile& file, const ReadOptions& options) {
  const auto grid = points_of(file, options.dataset);
  const std::string place = "grid " + in_quotes(grid->getName());
  std::vector<const PointLeaf*> leaves;
  grid->tree().getNodes(leaves);
  std::uint64_t count = 0;
  for (const PointLeaf* leaf : leaves) {
    leaf->validateOffsets();  // that each voxel's points are ones of the arrays
    count += leaf->pointCount();
  }
  check_unpacked(*memory_bytes(file), 3 * sizeof(float) * count, place);
  Particles particles;
  if (leaves.empty()) return particles;

  const AttributeSet::Descriptor& descriptor = leaves[0]->attributeSet().descriptor();
  const std::size_t positions = descriptor.find("P");
  if (positions == AttributeSet::INVALID_POS ||
      descriptor.valueType(positions) != openvdb::typeNameAsString<openvdb::Vec3f>())
    fail(file, place, "has no positions, wanted the attribute P of three 32-bit floats");
  resize(particles, {Field::x, Field::y, Field::z}, count);
  const std::vector<Column> columns =
      columns_for(file, leaves[0]->attributeSet(), options, count, particles);

  std::size_t at = 0;
  for (const PointLeaf* leaf : leaves) {
    const AttributeSet& attributes = leaf->attributeSet();
    if (attributes.descriptor() != descriptor)
      fail(file, place, "has leaves with different attributes, wanted the same in all");
    const Index points = static_cast<Index>(leaf->pointCount());
    const auto array_at = [&](std::size_t position, std::size_t component) -> decltype(auto) {
      const AttributeArray& array = *attributes.getConst(position);
      const std::size_t components = components_of(array);
      if (array.size() != points || component >= components)
        fail(file, place,
             "point " + std::to_string(at) + " and those behind it: an attribute has " +
                 std::to_string(array.size()) + " values of " + std::to_string(components) +
                 " components, wanted " + std::to_string(points) + " as in other leaves");
      return array;
    };
    read_positions(*leaf, array_at(positions, 2), grid->transform(), at, particles);
    for (const Column& column : columns)
      each_value(array_at(column.position, column.component), column.component,
                 [&](Index i, auto value) {
                   if (column.values) {
                     (*column.values)[at + i] = static_cast<float>(value);
                   } else if (const auto id = id_of(value)) {
                     particles.id[at + i] = *id;
                   } else {
                     fail(file, place,
                          "point " + std::to_string(at + i) + ": id is " +
                              shown(static_cast<double>(value)) + ", must be a whole number");
                   }
                 });
    at += points;
  }
  return particles;
}

}  // namespace

Particles read_vdb(const InputFile& file, const ReadOptions& options) {
  if (!file.bytes.starts_with(std::string_view(kMagic, sizeof kMagic)))
    fail(file, "byte 0",
         "found " + in_quotes(file.bytes.substr(0, sizeof kMagic)) +
             ", wanted \" BDV\" and four zeros (OpenVDB)");
  openvdb::initialize();
  try {
    return read_grid(file, options);
  } catch (const Error&) {
    throw;
  } catch (const std::ios_base::failure&) {
    fail(file, "", "the file ends before its grids do (truncated?)");
  } catch (const std::exception& error) {
    constexpr std::size_t kMost = 200;
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    fail(file, "", "OpenVDB cannot read it: " + printable(text, kMost));
  }
}

}  // namespace meniscus
