// HDF5 files: which of a file's data sets are the particles, and their values.
#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "io/array_bag.hpp"
#include "io/hdf5_chunks.hpp"
#include "io/hdf5_objects.hpp"
#include "io/readers.hpp"

namespace meniscus {
namespace {

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? "" : path.substr(0, slash);
}

std::string name_in_folder(const std::string& path) {
  const std::size_t folder = folder_of(path).size();
  return path.substr(folder == 0 ? 0 : folder + 1);
}

// The values of a data set.
BagArray array_of(const std::shared_ptr<const Bytes>& file, const Hdf5Objects& objects,
                  const Hdf5DataSet& data) {
  const std::string place = shown(data.path);
  std::uint64_t across = 1;
  for (std::size_t k = 1; k < data.shape.size(); ++k)
    if (__builtin_mul_overflow(across, data.shape[k], &across)) across = UINT64_MAX >> 20;
  refuse_shape(*file, place, name_in_folder(data.path), data.shape);
  constexpr std::uint64_t kMostAcross = 4096;
  if (across > kMostAcross) fail(*file, place, "has rows that are too long");
  BagArray array;
  array.rows = data.shape.empty() ? 1 : data.shape[0];
  array.data = {name_in_folder(data.path),
                static_cast<std::size_t>(across) * data.components,
                *data.type,
                data.order,
                nullptr,
                0,
                across * data.element,
                size_of(*data.type)};
  std::uint64_t bytes = 0;
  if (__builtin_mul_overflow(array.rows, array.data.stride, &bytes))
    fail(*file, place, "is too large");
  if (bytes == 0) {
    array.data.bytes = owned_bytes(file->name(), "");
  } else if (data.storage == 0) {
    array.data.bytes = owned_bytes(file->name(), data.compact);
  } else if (data.storage == 1) {
    if (data.address == kHdf5Undefined)
      fail(*file, place, "holds no values: none were ever written to it");
    if (data.size < bytes)
      fail(*file, place,
           "has room for " + std::to_string(data.size) + " bytes, wanted " + std::to_string(bytes) +
               " for its shape (damaged?)");
    array.data.bytes = file;
    if (__builtin_add_overflow(data.address, objects.base, &array.data.offset))
      fail(*file, place, "lies beyond the file's end (truncated?)");
  } else {
    check_unpacked(*file, bytes, place);
    array.data.bytes = hdf5_chunks(file, place, objects.base, data.address, objects.offsets,
                                   data.shape, data.chunk, data.element, data.filters);
  }
  return array;
}

using Groups = std::map<std::string, std::vector<const Hdf5DataSet*>>;

Groups groups_of(const Hdf5Objects& objects) {
  Groups groups;
  for (const Hdf5DataSet& found : objects.sets) groups[folder_of(found.path)].push_back(&found);
  return groups;
}

bool holds_positions(const std::vector<const Hdf5DataSet*>& sets) {
  return std::any_of(sets.begin(), sets.end(), [](const Hdf5DataSet* found) {
    const std::string name = name_in_folder(found->path);
    const bool of_vectors = found->shape.size() == 2 || found->components == 3;
    return of_vectors ? is_position(name) : lower_case(name) == "x";
  });
}

// Where nothing is asked for. Of what a simulation holds, the fluid is meant.
std::vector<std::string> groups_with_positions(const Groups& groups) {
  std::vector<std::string> candidates, fluid;
  for (const auto& [group, sets] : groups)
    if (holds_positions(sets)) candidates.push_back(group);
  if (candidates.empty() && groups.size() == 1) return {groups.begin()->first};
  for (const std::string& group : candidates)
    if (group == "fluid" || group.ends_with("/fluid") || group.ends_with("fluid/arrays"))
      fluid.push_back(group);
  return fluid.size() == 1 ? fluid : candidates;
}

// A group named by --dataset stands for itself, or for what is in it under "arrays", as PySPH has
// it; the name of a group alone will do where it is the only one.
std::vector<std::string> groups_named(const Groups& groups, const std::string& name) {
  std::vector<std::string> candidates;
  for (const auto& [group, sets] : groups)
    if (group == name || group == name + "/arrays" || group.ends_with("/" + name) ||
        group.ends_with("/" + name + "/arrays"))
      candidates.push_back(group);
  return candidates;
}

// Says why none of `candidates`, which are not one, is read.
[[noreturn]] void refuse(const Bytes& file, const Hdf5Objects& objects, const Groups& groups,
                         const std::vector<std::string>& candidates, const std::string& asked) {
  std::string list;
  for (const std::string& group : candidates) list += (list.empty() ? "/" : ", /") + group;
  if (candidates.empty())
    for (const auto& [group, sets] : groups)
      if (list.size() < 300) list += (list.empty() ? "/" : ", /") + group;
  fail(file, "",
       (candidates.empty()
            ? (asked.empty() ? "has no group with positions"
                             : "has no group or data set " + in_quotes(asked))
            : "holds particles in several groups, say which by " + setting("dataset")) +
           (list.empty() ? "" : ", it has " + shown(list)) +
           (objects.unknown.empty() ? "" : "; " + objects.unknown));
}

// What is read.
struct Choice {
  std::string group;
  std::string dataset;  // the one of its data sets that was asked for; empty: none was
};

Choice choose(const Bytes& file, const Hdf5Objects& objects, const Groups& groups,
              const std::string& asked) {
  for (const Hdf5DataSet& found : objects.sets)
    if (!asked.empty() && found.path == asked) return {folder_of(asked), name_in_folder(asked)};
  const std::vector<std::string> candidates =
      asked.empty() ? groups_with_positions(groups) : groups_named(groups, asked);
  if (candidates.size() != 1) refuse(file, objects, groups, candidates, asked);
  return {candidates[0], ""};
}

// The data sets of a group that hold numbers. `flaw` gets why one that has no use cannot be read;
// one that has a use is an error.
std::vector<BagArray> arrays_of(const std::shared_ptr<const Bytes>& file,
                                const Hdf5Objects& objects,
                                const std::vector<const Hdf5DataSet*>& sets, std::string& flaw) {
  std::vector<BagArray> arrays;
  for (const Hdf5DataSet* found : sets) try {
      if (!found->unknown.empty()) fail(*file, "", shown(found->path) + " " + found->unknown);
      if (!found->type || !found->has_space || found->shape.empty()) continue;
      arrays.push_back(array_of(file, objects, *found));
    } catch (const InputError& error) {
      if (has_use(name_in_folder(found->path))) throw;
      flaw = error.notice.text.substr(file->name().size() + 2);  // without "NAME: "
    }
  return arrays;
}

}  // namespace

Layout hdf5_layout(const std::shared_ptr<const Bytes>& file, const ReadOptions& options) {
  const Hdf5Objects objects = hdf5_objects(file);
  std::string asked = options.dataset;
  while (asked.starts_with("/")) asked.erase(0, 1);
  while (asked.ends_with("/")) asked.pop_back();
  const Groups groups = groups_of(objects);
  const Choice choice = choose(*file, objects, groups, asked);
  std::string flaw;
  std::vector<BagArray> arrays = arrays_of(file, objects, groups.at(choice.group), flaw);
  try {
    return layout_of_bag(*file, std::move(arrays), choice.dataset, options);
  } catch (const InputError& error) {
    if (flaw.empty()) throw;
    throw InputError(error.notice.text + "; " + flaw);
  }
}

}  // namespace meniscus
