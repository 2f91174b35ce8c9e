// How a device moves data and runs work-items, against what the host does in a plain loop.
#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <random>

#include "base/rounded_up.hpp"
#include "device/kernel_sources.hpp"
#include "device/records.hpp"
#include "verify/arithmetic.hpp"
#include "verify/bits.hpp"
#include "verify/probe.hpp"

namespace meniscus::verify {
namespace {

constexpr const char* kFile = "arithmetic.cl";
constexpr const char* kIds = "-D PROBE_IDS";

std::vector<cl_uint> random_words(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<cl_uint> words(count);
  for (cl_uint& word : words) word = static_cast<cl_uint>(random());
  return words;
}

// Floats between 2^-16 and 2^15 of both signs.
std::vector<float> random_floats(std::size_t count, unsigned seed) {
  std::vector<float> values;
  for (const cl_uint word : random_words(count, seed))
    values.push_back(float_of((word & 0x80ffffffu) | ((111 + (word >> 25 & 31)) << 23)));
  return values;
}

template <class T>
std::vector<std::uint32_t> words_of(const std::vector<T>& values) {
  std::vector<std::uint32_t> words;
  for (const T& value : values) words.push_back(std::bit_cast<std::uint32_t>(value));
  return words;
}

/// Passes when both are the same values; else says where they differ first.
template <class T>
Finding same(const std::vector<T>& expected, const std::vector<T>& found,
             const std::string& what = "value") {
  const Reading reading = std::is_same_v<T, float> ? Reading::floats : Reading::integers;
  const auto e = words_of(expected), f = words_of(found);
  const Difference difference = compare(e, f, reading);
  if (difference.count == 0) return {};
  const std::size_t i = difference.first;
  std::string reason = std::to_string(difference.count);
  reason += " of " + std::to_string(difference.of) + " differ, first " + what + " " +
            std::to_string(i) + ": expected " + hex(e[i], reading) + ", found " +
            hex(f[i], reading);
  return failed(reason, std::is_same_v<T, float> ? difference.ulp : -1);
}

// Runs a probe and reports its row.
using Probe =
    std::function<void(const char* name, const std::string& variant, const std::string& size,
                       bool required, const char* section, const std::function<Finding()>& run)>;

// --- Values in registers and in memory -----------------------------------------------------------

Finding sum_in_order(Device& device, int width) {
  constexpr std::size_t kSums = 512, kCount = 37;
  const std::vector<float> values = random_floats(kSums * kCount, 1);
  std::vector<float> expected(kSums, 0.0f);
  for (std::size_t k = 0; k < kCount; ++k)
    for (std::size_t i = 0; i < kSums; ++i) expected[i] += values[k * kSums + i];
  const auto sum = filled<float>(device, kSums, 0.0f);
  launch(device, kFile, "sum_in_order", {kSums / static_cast<std::size_t>(width)},
         width_option(width) + " -D PROBE_SUM_IN_ORDER", upload(device, values), sum,
         static_cast<cl_int>(kCount), static_cast<cl_int>(kSums));
  return same(expected, download(device, sum), "sum");
}

Finding copy_vectors(Device& device, int offset) {
  constexpr std::size_t kItems = 64;
  std::vector<cl_uint> values = random_words(14 * kItems + 16, 2);
  // Denormals among them: what is only moved stays as it is. No signalling NaN.
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] &= i % 5 == 0 ? 0x807fffffu : 0xbfffffffu;
  std::vector<float> given, expected(values.size(), -1.0f);
  for (const cl_uint word : values) given.push_back(float_of(word));
  const auto begin = static_cast<std::ptrdiff_t>(offset);
  std::copy_n(given.begin() + begin, 14 * kItems, expected.begin() + begin);
  const auto copy = filled<float>(device, given.size(), -1.0f);
  launch(device, kFile, "copy_vectors", {kItems}, "-D PROBE_VECTOR_LOADS", upload(device, given),
         copy, static_cast<cl_int>(offset));
  return same(expected, download(device, copy));
}

Finding take_lanes(Device& device) {
  constexpr std::size_t kItems = 256;
  std::vector<cl_int> from, expected;
  for (const cl_uint word : random_words(8 * kItems, 3)) from.push_back(static_cast<cl_int>(word));
  for (std::size_t i = 0; i < kItems; ++i) {
    cl_int* v = from.data() + 8 * i;
    if (i % 3 == 1)  // no lane, every lane, or just one below zero
      for (std::size_t k = 0; k < 8; ++k) v[k] &= 0x7fffffff;
    if (i % 3 == 2)
      for (std::size_t k = 0; k < 8; ++k) v[k] |= static_cast<cl_int>(0x80000000u);
    if (i % 2 == 1) v[i / 2 % 8] ^= static_cast<cl_int>(0x80000000u);
    const auto less = [](cl_int a, cl_int b) {
      return static_cast<cl_int>(static_cast<cl_uint>(a) - static_cast<cl_uint>(b));
    };
    for (int k = 0; k < 4; ++k) expected.push_back(less(v[k], v[k + 4]));
    expected.insert(expected.end(), {v[3], v[7], -(v[0] < 0) - 2 * (v[5] < 0)});
    const cl_int any = std::any_of(v, v + 8, [](cl_int x) { return x < 0; });
    const cl_int all = std::all_of(v, v + 8, [](cl_int x) { return x < 0; });
    const cl_int item = static_cast<cl_int>(i);
    expected.insert(expected.end(),
                    {any, all, any, all, v[1] ^ v[2], v[1] < 0 ? item : v[1],
                     v[6] < 0 ? item : v[6], (v[2] & 0xffff) / 2, (v[4] & 0xffff) / 2});
  }
  const auto taken = filled<cl_int>(device, 16 * kItems, -1);
  launch(device, kFile, "take_lanes", {kItems}, width_option(8) + " -D PROBE_LANES",
         upload(device, from), taken);
  return same(expected, download(device, taken));
}

Finding keep_pairs(Device& device, int width) {
  constexpr std::size_t kItems = 128, kTurn = 7;
  const auto lanes = static_cast<std::size_t>(width);
  const std::vector<float> from = random_floats(4 * lanes * kItems, 4);
  std::vector<float> expected;
  std::vector<cl_int> order;
  for (std::size_t i = 0; i < kItems; ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t source = (k * kTurn + 4 - i % 4) % 4;
      const auto other = static_cast<float>(source + kTurn);
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        const float value = from[(4 * i + source) * lanes + lane];
        expected.push_back(k % 2 == 0 ? value + other : value - other);
      }
      order.push_back(static_cast<cl_int>(source));
    }
  const auto to = filled<float>(device, from.size(), 0.0f);
  const auto found_order = filled<cl_int>(device, order.size(), -1);
  launch(device, kFile, "keep_pairs", {kItems}, width_option(width) + " -D PROBE_PRIVATE_MEMORY",
         upload(device, from), to, found_order, static_cast<cl_int>(kTurn));
  const Finding values = same(expected, download(device, to));
  return values.result == Result::pass ? same(order, download(device, found_order), "pair")
                                       : values;
}

Finding read_arguments(Device& device) {
  std::vector<float> expected(27);
  std::iota(expected.begin(), expected.end(), 1.0f);
  cl_float16 d;
  std::copy_n(expected.begin() + 4, 16, d.s);
  const auto result = filled<float>(device, expected.size(), 0.0f);
  launch(device, kFile, "read_arguments", {1}, "-D PROBE_ARGUMENTS", result, cl_int{1},
         cl_int2{{2, 3}}, cl_float{4}, d, cl_uint{21}, cl_float2{{22, 23}},
         cl_float4{{24, 25, 26, 27}});
  return same(expected, download(device, result), "component");
}

// A record whose words are numbered from `first` on; they are put behind `all`.
template <class Record>
Record numbered(std::vector<cl_uint>& all, cl_uint first) {
  std::array<cl_uint, sizeof(Record) / sizeof(cl_uint)> words;
  std::iota(words.begin(), words.end(), first);
  all.insert(all.end(), words.begin(), words.end());
  return std::bit_cast<Record>(words);
}

Finding read_records(Device& device) {
  std::vector<cl_uint> expected;
  const auto a = numbered<records::Settling>(expected, 100);
  const auto b = numbered<cl_float>(expected, 200);
  const auto c = numbered<records::Projection>(expected, 300);
  const auto d = numbered<records::Chunked>(expected, 400);
  const auto e = numbered<cl_float4>(expected, 500);
  const auto f = numbered<records::FitPass>(expected, 600);
  const auto g = numbered<records::Closing>(expected, 700);
  for (const auto value :
       {static_cast<cl_uint>(a.only_gaps), std::bit_cast<cl_uint>(a.screen.rays.dy_v),
        std::bit_cast<cl_uint>(c.height), std::bit_cast<cl_uint>(c.w_row[3]),
        static_cast<cl_uint>(d.own), std::bit_cast<cl_uint>(f.height_growth),
        std::bit_cast<cl_uint>(f.model.ridge_gain), std::bit_cast<cl_uint>(g.large_until),
        static_cast<cl_uint>(g.blocks.stride)})
    expected.push_back(value);
  const auto words = filled<cl_uint>(device, expected.size(), 0u);
  launch(device, kFile, "read_records", {1}, "-D PROBE_RECORDS", words, a, b, c, d, e, f, g);
  return same(expected, download(device, words), "word");
}

void probe_values(Device& device, const Probe& probe) {
  for (const int width : {1, 8}) {
    const std::string variant = "width " + std::to_string(width);
    probe("sum_in_order", variant, "512 sums of 37", true,
          "OpenCL API 1.2, 5.6.4.3 (nothing is reassociated unasked)",
          [&] { return sum_in_order(device, width); });
    probe("private_memory", variant, "128 items", true, "OpenCL C 1.2, 6.5.4 and 6.8",
          [&] { return keep_pairs(device, width); });
  }
  for (const int offset : {0, 1, 2, 3, 7})
    probe("vector_loads", "offset " + std::to_string(offset), "64 items", true,
          "OpenCL C 1.2, 6.12.7", [&] { return copy_vectors(device, offset); });
  probe("lanes", "", "256 items", true, "OpenCL C 1.2, 6.1.7, 6.3 and 6.12.6",
        [&] { return take_lanes(device); });
  probe("arguments", "", "27 components", true, "OpenCL API 1.2, 5.7.2; C 6.1.5",
        [&] { return read_arguments(device); });
  probe("records", "", "7 arguments", true, "OpenCL C 1.2, 6.9 and 6.3",
        [&] { return read_records(device); });
}

// --- Atomics -------------------------------------------------------------------------------------

Finding take_tickets(Device& device, std::size_t items, cl_uint counters) {
  const auto counter = filled<cl_uint>(device, counters, 0u);
  const auto ticket = filled<cl_uint>(device, items, 0xffffffffu);
  launch(device, kFile, "take_tickets", {items}, "-D PROBE_TICKETS", counter, ticket, counters - 1);
  const std::size_t each = items / counters;
  const Finding last = same(std::vector<cl_uint>(counters, static_cast<cl_uint>(each)),
                            download(device, counter), "counter");
  if (last.result == Result::fail) return last;
  // Every counter's tickets are 0, 1, ... in some order.
  std::vector<cl_uint> drawn(items, 0), once(items, 1);
  const std::vector<cl_uint> tickets = download(device, ticket);
  for (std::size_t i = 0; i < items; ++i)
    if (tickets[i] < each) ++drawn[i % counters * each + tickets[i]];
  return same(once, drawn, "ticket (how often it was drawn)");
}

Finding bound_values(Device& device, std::size_t items, cl_uint words) {
  const std::vector<cl_uint> values = random_words(items, 5);
  std::vector<cl_uint> least(words, 0xffffffffu), sum(words, 0);
  std::vector<cl_int> least_signed(words, 0x7fffffff);
  for (std::size_t i = 0; i < items; ++i) {
    const std::size_t at = i % words;
    least[at] = std::min(least[at], values[i]);
    least_signed[at] = std::min(least_signed[at], static_cast<cl_int>(values[i]));
    sum[at] += values[i];
  }
  const auto a = filled<cl_uint>(device, words, 0xffffffffu);
  const auto b = filled<cl_int>(device, words, 0x7fffffff);
  const auto c = filled<cl_uint>(device, words, 0u);
  launch(device, kFile, "bound_values", {items}, "-D PROBE_ATOMIC_BOUNDS", upload(device, values),
         a, b, c, words - 1);
  for (const Finding& finding : {same(least, download(device, a), "minimum"),
                                 same(least_signed, download(device, b), "signed minimum"),
                                 same(sum, download(device, c), "sum")})
    if (finding.result != Result::pass) return finding;
  return {};
}

Finding lower_longs(Device& device) {
  const std::string extensions = handle_of(device.info()).getInfo<CL_DEVICE_EXTENSIONS>();
  if (extensions.find("cl_khr_int64_extended_atomics") == std::string::npos)
    return skipped("the device does not offer cl_khr_int64_extended_atomics");
  constexpr std::size_t kItems = 2048, kWords = 64;
  std::vector<cl_uint> values = random_words(kItems, 6), low(kWords), high(kWords);
  for (cl_uint& value : values) value %= 8;  // many ties, which the item decides
  std::vector<cl_ulong> least(kWords, ~cl_ulong{0});
  for (std::size_t i = 0; i < kItems; ++i)
    least[i % kWords] = std::min(least[i % kWords], cl_ulong{values[i]} << 32 | i);
  const Buffer<cl_ulong> words = upload(device, std::vector<cl_ulong>(kWords, ~cl_ulong{0}));
  launch(device, kFile, "lower_longs", {kItems}, "-D PROBE_LONG_ATOMICS", upload(device, values),
         words, static_cast<cl_uint>(kWords - 1));
  const std::vector<cl_ulong> found = download(device, words);
  const std::size_t at = static_cast<std::size_t>(
      std::mismatch(least.begin(), least.end(), found.begin()).first - least.begin());
  return at == kWords ? Finding{} : failed("word " + std::to_string(at) + " is not the minimum");
}

void probe_atomics(Device& device, const Probe& probe) {
  for (const cl_uint counters : {1u, 64u}) {
    const std::string variant = counters == 1 ? "one word" : "64 words";
    probe("tickets", variant, "2048 items", true, "OpenCL C 1.2, 6.12.11",
          [&] { return take_tickets(device, 2048, counters); });
    probe("atomic_bounds", variant, "2048 items", true, "OpenCL C 1.2, 6.12.11",
          [&] { return bound_values(device, 2048, counters); });
  }
  probe("long_atomics", "64 words", "2048 items", false, "OpenCL extensions 1.2, 9.3",
        [&] { return lower_longs(device); });
}

// --- Work-groups and ranges ----------------------------------------------------------------------

// CL_KERNEL_WORK_GROUP_SIZE: launches cut their groups down to that.
std::size_t most_items(Device& device, const char* kernel, const std::string& options) {
  return device.state().kernel(kFile, kernel, options).most_items;
}

Finding too_small(std::size_t most) {
  return skipped("the kernel may have groups of " + std::to_string(most) + " at most");
}

Finding sum_up_to(Device& device, std::size_t group, std::size_t n) {
  std::vector<cl_int> value(n), expected(n);
  for (std::size_t i = 0; i < n; ++i) {
    value[i] = static_cast<cl_int>(i * i % 1009);
    expected[i] = value[i] + (i % group ? expected[i - 1] : 0);
  }
  const std::string options = "-D PROBE_BARRIERS -D GROUP=" + std::to_string(group);
  if (const std::size_t most = most_items(device, "sum_up_to", options); most < group)
    return too_small(most);
  const auto sum = filled<cl_int>(device, n, -1);
  launch(device, kFile, "sum_up_to", {n, 1, group, 1}, options, upload(device, value), sum,
         static_cast<cl_int>(n));
  return same(expected, download(device, sum), "sum");
}

Finding turn_local(Device& device, std::size_t bytes) {
  const std::size_t words = bytes / sizeof(cl_uint);
  const std::string options = "-D PROBE_LOCAL_MEMORY -D WORDS=" + std::to_string(words) + "u";
  std::size_t group = 64;
  while (group > std::max<std::size_t>(1, most_items(device, "turn_local", options))) group /= 2;
  std::vector<cl_uint> expected;
  for (std::size_t i = 0; i < 3 * group; ++i) {
    cl_uint total = 0;
    for (std::size_t k = i % group; k < words; k += group)
      total = total * 31 + static_cast<cl_uint>((words - 1 - k) * 2654435761u + i / group);
    expected.push_back(total);
  }
  const auto sum = filled<cl_uint>(device, expected.size(), 0u);
  launch(device, kFile, "turn_local", {expected.size(), 1, group, 1}, options, sum);
  return same(expected, download(device, sum), "item");
}

Finding name_items(Device& device, const Range& range) {
  const std::size_t nx = rounded_up(range.nx, range.group_x),
                    ny = rounded_up(range.ny, range.group_y);
  const std::size_t groups_x = nx / range.group_x, groups = groups_x * (ny / range.group_y);
  std::vector<cl_int> expected;
  for (std::size_t j = 0; j < ny; ++j)
    for (std::size_t i = 0; i < nx; ++i)
      for (const std::size_t name : {i, j, i / range.group_x + groups_x * (j / range.group_y),
                                     i % range.group_x + range.group_x * (j % range.group_y),
                                     groups, range.group_x * range.group_y})
        expected.push_back(static_cast<cl_int>(name));
  const auto names = filled<cl_int>(device, expected.size(), -1);
  launch(device, kFile, "name_items", range, kIds, names);
  return same(expected, download(device, names), "name");
}

void probe_groups(Device& device, const Probe& probe) {
  // No kernel of ours needs barriers or local memory; a device without them is a poor one.
  for (const std::size_t group : {16, 64})
    for (const std::size_t n : {64, 1, 203})
      probe("barriers", "groups of " + std::to_string(group), std::to_string(n) + " items", false,
            "OpenCL C 1.2, 6.12.8 and 6.5.2", [&] { return sum_up_to(device, group, n); });
  probe("local_memory", "", "32 KiB", false, "OpenCL API 1.2, table 4.3; C 6.5.2", [&] {
    const std::uint64_t there = device.info().local_memory;
    return there < 32768
               ? skipped("the device has " + std::to_string(there) + " bytes of local memory")
               : turn_local(device, 32768);
  });
  for (const Range& range : {Range{1, 1, 64, 1}, Range{203, 1, 64, 1}, Range{37, 21, 16, 16},
                             Range{5, 70, 2, 16}, Range{1, 1, 1, 1}}) {
    const bool plane = range.ny > 1;
    probe("ids",
          "groups of " + std::to_string(range.group_x) +
              (plane ? " x " + std::to_string(range.group_y) : ""),
          std::to_string(range.nx) + (plane ? " x " + std::to_string(range.ny) : "") + " items",
          true, "OpenCL C 1.2, 6.12.1; API 5.8", [&] {
            const std::size_t most = work_group_claimed(device);
            return range.group_x * range.group_y > most ? too_small(most)
                                                        : name_items(device, range);
          });
  }
}

// --- Buffers and commands ------------------------------------------------------------------------

Finding move_buffer(Device& device, std::size_t count) {
  const std::vector<cl_uint> values = random_words(count, 7);
  const auto buffer = upload(device, values);
  if (const Finding read = same(values, download(device, buffer)); read.result != Result::pass)
    return failed("written and read: " + read.reason);
  {
    const HostView<cl_uint> view(device, buffer);
    if (!std::equal(values.begin(), values.end(), view.data()))
      return failed("mapped for reading: not what was written");
  }
  const auto words = filled<cl_uint>(device, count, 0x01020304u);
  const Finding fill = same(std::vector<cl_uint>(count, 0x01020304u), download(device, words));
  if (fill.result != Result::pass) return failed("filled with words: " + fill.reason);
  const auto bytes = filled<cl_uchar>(device, count, cl_uchar{0x5a});
  if (download(device, bytes) != std::vector<cl_uchar>(count, 0x5a))
    return failed("filled with bytes: not what was asked for");
  return {};
}

Finding mix_neighbours(Device& device, std::size_t n, int launches) {
  std::vector<cl_uint> values = random_words(n, 8);
  Buffer<cl_uint> from = upload(device, values), to = filled<cl_uint>(device, n, 0u);
  for (int k = 0; k < launches; ++k) {
    launch(device, kFile, "mix_neighbours", {n}, "-D PROBE_ORDER", from, to,
           static_cast<cl_int>(n));
    std::swap(from, to);
    std::vector<cl_uint> next(n);
    for (std::size_t i = 0; i < n; ++i)
      next[i] = values[(i + n - 1) % n] * 3u + values[(i + 1) % n] + static_cast<cl_uint>(i);
    values = next;
  }
  return same(values, download(device, from));
}

Finding read_macros(Device& device) {
  cl_int line = 0;
  for (const KernelSource& source : kernel_sources())
    if (source.file == kFile) {
      const auto at = source.text.find("__LINE__;  // the line that the host looks for");
      line = 1 + static_cast<cl_int>(std::count(source.text.begin(),
                                                source.text.begin() + static_cast<int>(at), '\n'));
    }
  const auto result = filled<cl_int>(device, 2, 0);
  launch(device, kFile, "read_macros", {1}, "-D PROBE_MACROS -D VALUE=-12345", result);
  const std::vector<cl_int> found = download(device, result);
  if (found[0] != -12345) return failed("-D VALUE=-12345 became " + std::to_string(found[0]));
  if (found[1] != line)
    return failed("after #line, __LINE__ is " + std::to_string(found[1]) + " where the file has " +
                  std::to_string(line));
  return {};
}

void probe_commands(Device& device, const Probe& probe) {
  // The last one is filled by a kernel of ours on CPUs (fill.cl).
  for (const std::size_t count : {1, 15, 17, 1023, 65549})
    probe("buffers", "", std::to_string(count) + " words", true, "OpenCL API 1.2, 5.2.2 to 5.2.4",
          [&] { return move_buffer(device, count); });
  probe("order", "100 launches", "203 items", true, "OpenCL API 1.2, 3.2.1, 3.3.1 and 5.11",
        [&] { return mix_neighbours(device, 203, 100); });
  probe("macros", "", "", true, "OpenCL API 1.2, 5.6.4.1; C 6.10",
        [&] { return read_macros(device); });
}

}  // namespace

bool local_memory_works(Device& device, std::size_t bytes) {
  return turn_local(device, bytes).result == Result::pass;
}

bool work_group_works(Device& device, std::size_t items) {
  return name_items(device, {items, 1, items, 1}).result == Result::pass;
}

std::size_t work_group_claimed(Device& device) { return most_items(device, "name_items", kIds); }

void probe_execution(Device& device, const Report& report) {
  const Probe probe = [&](const char* name, const std::string& variant, const std::string& size,
                          bool required, const char* section, const std::function<Finding()>& run) {
    report_probe({.group = "probe",
                  .kernel = name,
                  .variant = variant,
                  .size = size,
                  .required = required,
                  .section = section},
                 run, report);
  };
  probe_values(device, probe);
  probe_atomics(device, probe);
  probe_groups(device, probe);
  probe_commands(device, probe);
}

}  // namespace meniscus::verify
