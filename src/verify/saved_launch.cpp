#include "verify/saved_launch.hpp"

#include <algorithm>

#include "base/content_hash.hpp"
#include "base/grouped.hpp"
#include "verify/bits.hpp"

namespace meniscus::verify {
namespace {

std::vector<std::uint32_t> words_of(const Bytes& bytes) {
  std::vector<std::uint32_t> words((bytes.size() + 3) / 4);
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::uint8_t*>(words.data()));
  return words;
}

// The entries of a list without an order, in one: sorted by their bytes.
Bytes in_order(const Bytes& bytes, std::size_t entry) {
  if (entry == 0) return bytes;
  std::vector<std::string> entries;
  for (std::size_t k = 0; k + entry <= bytes.size(); k += entry)
    entries.emplace_back(reinterpret_cast<const char*>(bytes.data() + k), entry);
  std::sort(entries.begin(), entries.end());
  Bytes all;
  for (const std::string& one : entries) all.insert(all.end(), one.begin(), one.end());
  return all;
}

}  // namespace

SavedLaunch saved(Device& device, const KernelLaunch& launch, const std::vector<Bytes>& before,
                  const std::vector<std::string>& names, bool built) {
  Device::State& state = device.state();
  const std::size_t most =
      built ? state.kernel(launch.file, launch.kernel, launch.options)
                  .getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(handle_of(state.info))
            : state.info.largest_group;
  SavedLaunch saved{launch.file,
                    launch.kernel,
                    launch.options,
                    state.source_of(launch.file),
                    state.build_options(launch.options),
                    launch.range,
                    state.launched_range(launch.range, most),
                    {}};
  for (std::size_t k = 0; k < launch.arguments.size(); ++k) {
    const KernelLaunch::Argument& seen = launch.arguments[k];
    SavedLaunch::Argument& argument = saved.arguments.emplace_back();
    argument.name = names[k];
    argument.is_buffer = seen.buffer != nullptr;
    argument.floats = seen.floats;
    if (seen.buffer) {
      argument.before = before[k];
      argument.room = seen.buffer->getInfo<CL_MEM_SIZE>();
    } else {
      const auto* bytes = static_cast<const std::uint8_t*>(seen.scalar);
      argument.before.assign(bytes, bytes + seen.scalar_bytes);
    }
  }
  return saved;
}

std::size_t unordered_entry(const std::string& argument) {
  return argument == "entry" ? 8 : argument == "selected" ? 4 : 0;
}

std::uint64_t hash_of(const Bytes& bytes, const std::string& argument) {
  const std::size_t entry = unordered_entry(argument);
  if (entry == 0) return content_hash(bytes.data(), bytes.size());
  std::uint64_t sum = bytes.size();
  for (std::size_t k = 0; k + entry <= bytes.size(); k += entry)
    sum += content_hash(bytes.data() + k, entry);
  return sum;
}

std::string difference(const std::string& argument, bool floats, const Bytes& expected,
                       const Bytes& found, double* ulp) {
  std::string text = "argument " + argument + ": ";
  if (expected.size() != found.size())
    return text + std::to_string(found.size()) + " bytes for " + std::to_string(expected.size());
  const Reading reading = floats ? Reading::floats : Reading::integers;
  const std::size_t entry = unordered_entry(argument);
  const std::vector<std::uint32_t> wanted = words_of(in_order(expected, entry)),
                                   own = words_of(in_order(found, entry));
  const Difference d = compare(wanted, own, reading);
  if (d.count == 0) return text + "only the bits of what is no number differ";
  if (ulp) *ulp = std::max(*ulp, d.ulp);
  text += grouped(d.count) + " of ";
  text += grouped(d.of) + " values differ, the first at ";
  text += std::to_string(d.first) + ": found " + hex(own[d.first], reading);
  text += ", wanted " + hex(wanted[d.first], reading);
  return text;
}

std::vector<Bytes> run_again(Device& device, const SavedLaunch& launch) {
  Device::State& state = device.state();
  cl::Kernel& kernel = state.kernel(launch.file, launch.kernel, launch.options);
  std::vector<Memory> memory;
  cl_uint index = 0;
  try {
    for (const SavedLaunch::Argument& argument : launch.arguments) {
      memory.emplace_back();
      if (argument.is_buffer) {
        memory.back() = state.allocate_bytes(argument.before.size(), true);
        if (!argument.before.empty())
          state.write_bytes(memory.back(), argument.before.data(), argument.before.size());
        kernel.setArg(index++, static_cast<const cl::Buffer&>(memory.back()));
      } else {
        kernel.setArg(index++, argument.before.size(), argument.before.data());
      }
    }
  } catch (const cl::Error& error) {
    state.fail("giving " + launch.kernel + " its arguments", error);
  }
  state.enqueue(kernel, launch.kernel, launch.wanted);
  std::vector<Bytes> left;
  for (std::size_t k = 0; k < launch.arguments.size(); ++k) {
    left.emplace_back(launch.arguments[k].is_buffer ? launch.arguments[k].before.size() : 0);
    if (!left.back().empty()) state.read_bytes(memory[k], left.back().data(), left.back().size());
  }
  return left;
}

}  // namespace meniscus::verify
