#include "verify/limits.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <numeric>

#include "base/elapsed.hpp"
#include "base/printed.hpp"
#include "device/probe.hpp"
#include "device/records.hpp"
#include "verify/arithmetic.hpp"
#include "verify/probe.hpp"

namespace meniscus::verify {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

// "4.0 GiB", "256 MiB", "32 KiB", "100 bytes".
std::string bytes_in_words(double bytes) {
  const char* const units[] = {"bytes", "KiB", "MiB", "GiB"};
  int unit = 0;
  while (bytes >= 1024 && unit < 3) {
    bytes /= 1024;
    ++unit;
  }
  char text[32];
  std::snprintf(text, sizeof text, bytes == static_cast<long long>(bytes) ? "%.0f %s" : "%.1f %s",
                bytes, units[unit]);
  return text;
}

std::string in_words(double value, const char* unit) { return three_digits(value) + " " + unit; }

// What the host can spare: half of the memory that is available without swapping.
std::size_t spare_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string name;
  std::size_t kilobytes = 0;
  while (meminfo >> name >> kilobytes) {
    if (name == "MemAvailable:") return kilobytes * 1024 / 2;
    std::getline(meminfo, name);
  }
  const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGE_SIZE);
  return static_cast<std::size_t>(std::max(pages, 0L)) * static_cast<std::size_t>(page) / 4;
}

// Whether a buffer can be had whose both ends keep what is written to them.
bool buffer_works(Device& device, std::size_t bytes) {
  try {
    const cl::CommandQueue& queue = device.state().queue;
    const cl::Buffer buffer(device.state().context, CL_MEM_READ_WRITE, bytes);
    const std::size_t end = std::min<std::size_t>(bytes, 64);
    std::vector<unsigned char> first(end), last(end), found(end);
    std::iota(first.begin(), first.end(), static_cast<unsigned char>(1));
    std::iota(last.begin(), last.end(), static_cast<unsigned char>(101));
    queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, end, first.data());
    queue.enqueueReadBuffer(buffer, CL_TRUE, 0, end, found.data());
    if (found != first) return false;
    queue.enqueueWriteBuffer(buffer, CL_TRUE, bytes - end, end, last.data());
    queue.enqueueReadBuffer(buffer, CL_TRUE, bytes - end, end, found.data());
    return found == last;
  } catch (const cl::Error&) {
    return false;
  }
}

// A kernel that throws does not work either.
bool works(const std::function<bool()>& check) {
  try {
    return check();
  } catch (const std::exception&) {
    return false;
  }
}

Row row_of(const char* limit, const std::string& variant, const std::string& size,
           const char* section) {
  return {.group = "limit",
          .kernel = limit,
          .variant = variant,
          .size = size,
          .required = false,
          .section = section};
}

/// A limit that the device claims and how far it holds.
struct Limit {
  const char* name;
  const char* section;
  const char* claimed_as;     // the query
  std::size_t claimed, most;  // by the device; that is tried
  std::size_t needed, step;   // by Meniscus; to which it is found
  std::string (*words)(double);
  std::function<bool(std::size_t)> works;
};

void probe_limit(const Limit& limit, const Report& report) {
  const auto words = [&](std::size_t n) { return limit.words(static_cast<double>(n)); };
  Row row = row_of(limit.name, "", "up to " + words(limit.most), limit.section);
  std::size_t found = 0;
  report_probe(
      row,
      [&]() -> Finding {
        found = largest_that_works(limit.most, limit.step, limit.works);
        const std::string what = words(found) + (found ? " work" : ": nothing works") + ", " +
                                 limit.claimed_as + " is " + words(limit.claimed);
        if (found >= limit.most) return {Result::pass, what};
        return failed(what);
      },
      [&](Row own) {
        own.required = found < limit.needed;
        report(std::move(own));
      });
}

double seconds_of(const std::function<void()>& run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  return seconds_since(begin);
}

// From the source of one of our larger kernels to the end of its first launch, which finds nothing
// to do: some runtimes do most of the work at the first launch.
double build_seconds(Device& device, const std::string& option) {
  const auto floats = filled<float>(device, 64, 0.0f);
  const auto words = filled<cl_uint>(device, 64, 0u);
  const auto starts = filled<cl_int>(device, 64, 0);
  device.state().queue.finish();
  return seconds_of([&] {
    launch(device, "density.cl", "measure_gradients", {64},
           width_option(device.state().vector_width) + option, floats, floats, floats, floats,
           floats, floats, words, starts, records::CellGrid{1, 63}, cl_int{0}, cl_int{0},
           cl_float2{{1, 1}});
    device.state().queue.finish();
  });
}

void probe_builds(Device& device, const Report& report) {
  constexpr const char* kSection = "OpenCL API 1.2, 5.6.2";
  report_probe(
      row_of("build_time", "cold", "measure_gradients", kSection),
      [&]() -> Finding {
        Device fresh(device.info());
        fresh.state().keeps = Keeps::nothing;
        // An option that no cache has seen.
        const auto now = std::chrono::system_clock::now().time_since_epoch().count();
        const double seconds = build_seconds(fresh, " -D UNSEEN=" + std::to_string(now));
        return {Result::pass, in_words(1e3 * seconds, "ms with nothing to reuse")};
      },
      report);
  report_probe(
      row_of("build_time", "warm", "measure_gradients", kSection),
      [&]() -> Finding {
        Device first(device.info()), second(device.info());
        build_seconds(first, " -D SEEN");
        const double seconds = build_seconds(second, " -D SEEN");
        return {Result::pass, in_words(1e3 * seconds, "ms where it was built before")};
      },
      report);
}

void probe_launches(Device& device, const Report& report) {
  report_probe(
      row_of("launch_cost", "", "100 launches", "OpenCL API 1.2, 5.8"),
      [&]() -> Finding {
        // Nobody is told of its launches: that takes longer than a launch.
        Device fresh(device.info());
        const LaunchCost cost = measure_launches(fresh, 5);
        return {Result::pass, in_words(cost.single_us, "us alone, ") +
                                  in_words(cost.batched_us, "us among many")};
      },
      report);
}

void probe_transfers(Device& device, std::size_t bytes, const Report& report) {
  const auto rate = [&](double seconds) {
    return in_words(1e-9 * static_cast<double>(bytes) / seconds, "GB/s");
  };
  const std::vector<cl_uint> values(bytes / sizeof(cl_uint), 0x01020304u);
  constexpr int kTries = 3;
  constexpr const char* kSection = "OpenCL API 1.2, 5.2.2";
  const std::string size = bytes_in_words(static_cast<double>(bytes));
  report_probe(
      row_of("transfer", "upload", size, kSection),
      [&]() -> Finding {
        double best = INFINITY;
        const auto buffer = allocate<cl_uint>(device, values.size());
        for (int k = 0; k < kTries; ++k)
          best = std::min(best, seconds_of([&] {
                            device.state().write_bytes(buffer.memory, values.data(), bytes);
                          }));
        return {Result::pass, rate(best)};
      },
      report);
  report_probe(
      row_of("transfer", "download", size, kSection),
      [&]() -> Finding {
        double best = INFINITY;
        const auto buffer = upload(device, values);
        std::vector<cl_uint> found(values.size());
        for (int k = 0; k < kTries; ++k)
          best = std::min(best, seconds_of([&] {
                            device.state().read_bytes(buffer.memory, found.data(), bytes);
                          }));
        if (found != values) return failed("what came back is not what was sent");
        return {Result::pass, rate(best)};
      },
      report);
}

}  // namespace

std::size_t largest_that_works(std::size_t most, std::size_t step,
                               const std::function<bool(std::size_t)>& works) {
  if (works(most)) return most;
  std::size_t good = 0, bad = most;
  while (bad - good > step) {
    const std::size_t middle = good + (bad - good) / 2;
    (works(middle) ? good : bad) = middle;
  }
  return good;
}

void probe_limits(Device& device, bool full, const Report& report) {
  const DeviceInfo& info = device.info();
  const std::size_t claimed = info.largest_buffer;
  const std::size_t spare = full ? spare_memory() : std::min(spare_memory(), 256 * kMiB);
  probe_limit({"largest_buffer", "OpenCL API 1.2, 5.2.1 and table 4.3",
               "CL_DEVICE_MAX_MEM_ALLOC_SIZE", claimed, std::min(claimed, spare), 16 * kMiB, kMiB,
               bytes_in_words, [&](std::size_t n) { return buffer_works(device, n); }},
              report);

  // A kernel may allow fewer work-items in a group than the device does, and says so.
  std::size_t group = info.largest_group;
  works([&] { return group = std::min(group, work_group_claimed(device)), true; });
  const auto items = [](double n) { return std::to_string(static_cast<long long>(n)) + " items"; };
  probe_limit({"work_group", "OpenCL API 1.2, 5.7.3, 5.8 and table 4.3",
               "CL_KERNEL_WORK_GROUP_SIZE", group, group, 1, 1, items,
               [&](std::size_t n) { return works([&] { return work_group_works(device, n); }); }},
              report);
  probe_launches(device, report);
  probe_transfers(device, std::min((full ? 64 : 16) * kMiB, std::min(claimed, spare) / 2), report);
  probe_builds(device, report);
  // Last, because there are runtimes that crash here. No kernel of ours has local memory.
  probe_limit({"local_memory", "OpenCL C 1.2, 6.5.2; API table 4.3", "CL_DEVICE_LOCAL_MEM_SIZE",
               info.local_memory, info.local_memory, 0, 1024, bytes_in_words,
               [&](std::size_t n) { return works([&] { return local_memory_works(device, n); }); }},
              report);
}

}  // namespace meniscus::verify
