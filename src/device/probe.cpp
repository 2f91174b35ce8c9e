#include "device/probe.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "base/elapsed.hpp"
#include "device/kernels.hpp"

namespace meniscus {
namespace {

double wall_seconds(const std::function<void()>& run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  return seconds_since(begin);
}

// The shortest of several tries, seconds on the device. The first one is not counted.
double best_seconds(Device& device, const ProbeEffort& effort, const std::function<void()>& run) {
  double best = INFINITY;
  const auto begin = std::chrono::steady_clock::now();
  for (int k = 0; k <= effort.tries || seconds_since(begin) < effort.seconds; ++k) {
    device.state().take_times();
    run();
    double sum = 0;
    for (const auto& [kernel, ms] : device.state().take_times()) sum += 1e-3 * ms;
    if (k > 0) best = std::min(best, sum);
  }
  return std::max(best, 1e-9);  // a clock may stand still for what is too short
}

double arithmetic_rate(Device& device, const auto& kernel, int chains, float factor, float addend,
                       const ProbeEffort& effort) {
  const int width = device.state().vector_width;
  // Enough work-groups for every compute unit, however many of them one holds.
  const std::size_t items = std::size_t{64} * 64 * std::max(1u, device.info().compute_units);
  const auto result = allocate<float>(device, items * static_cast<std::size_t>(width));
  const double seconds = best_seconds(device, effort, [&] {
    launch(device, kernel, width, {items}, result, cl_int{effort.arithmetic_rounds}, factor,
           addend);
  });
  const double steps = 16.0 * chains * effort.arithmetic_rounds * width;
  return 1e-9 * static_cast<double>(items) * steps / seconds;
}

double atomic_rate(Device& device, cl_uint mask, const ProbeEffort& effort) {
  const auto words = filled<cl_uint>(device, effort.atomics, 0xffffffffu);
  const double seconds = best_seconds(device, effort, [&] {
    launch(device, kernels::lower_words, 1, {effort.atomics}, words, mask);
  });
  return 1e-9 * static_cast<double>(effort.atomics) / seconds;
}

}  // namespace

double Roofline::bandwidth(double bytes) const {
  if (copy.empty()) return 0;
  if (bytes <= copy.front().bytes) return copy.front().gb_per_s;
  for (std::size_t k = 1; k < copy.size(); ++k) {
    if (bytes > copy[k].bytes) continue;
    const double share =
        std::log(bytes / copy[k - 1].bytes) / std::log(copy[k].bytes / copy[k - 1].bytes);
    return (1 - share) * copy[k - 1].gb_per_s + share * copy[k].gb_per_s;
  }
  return copy.back().gb_per_s;
}

double Roofline::peak_gflops() const { return std::max(fused_gflops, plain_gflops); }

Roofline better_of(const Roofline& a, const Roofline& b) {
  Roofline better = a;
  for (std::size_t k = 0; k < std::min(a.copy.size(), b.copy.size()); ++k)
    better.copy[k].gb_per_s = std::max(a.copy[k].gb_per_s, b.copy[k].gb_per_s);
  better.fused_gflops = std::max(a.fused_gflops, b.fused_gflops);
  better.plain_gflops = std::max(a.plain_gflops, b.plain_gflops);
  better.launch_us = std::min(a.launch_us, b.launch_us);
  better.batched_launch_us = std::min(a.batched_launch_us, b.batched_launch_us);
  better.empty_kernel_us = std::min(a.empty_kernel_us, b.empty_kernel_us);
  better.spread_atomics = std::max(a.spread_atomics, b.spread_atomics);
  better.contended_atomics = std::max(a.contended_atomics, b.contended_atomics);
  return better;
}

LaunchCost measure_launches(Device& device, int tries) {
  const auto one = allocate<float>(device, 64);
  const auto launch_one = [&] { launch(device, kernels::write_one, 1, {64}, one); };
  constexpr int kBatch = 100;
  double single = INFINITY, batched = INFINITY;
  launch_one();
  for (int k = 0; k < tries; ++k) {
    device.state().take_times();
    single = std::min(single, wall_seconds([&] {
                        launch_one();
                        device.state().queue.finish();
                      }));
    batched = std::min(batched, wall_seconds([&] {
                         for (int n = 0; n < kBatch; ++n) launch_one();
                         device.state().queue.finish();
                       }));
  }
  device.state().take_times();
  return {1e6 * single, 1e6 * batched / kBatch};
}

Roofline measure_roofline(Device& device, const ProbeEffort& effort) {
  Roofline roofline;
  const int width = device.state().vector_width;
  const auto copied = static_cast<std::size_t>(std::max(width, 4));  // by an item
  std::vector<std::size_t> sizes = effort.copy_bytes;
  if (!device.state().is_in_place()) sizes.push_back(8 * sizes.back());  // caches are large there
  for (const std::size_t bytes : sizes) {
    if (bytes / 2 > device.state().most_bytes()) continue;
    const std::size_t values = bytes / 2 / sizeof(float) / 512 * 512;
    const auto from = filled<float>(device, values, 1.0f), to = filled<float>(device, values, 0.0f);
    const double seconds = best_seconds(device, effort, [&] {
      launch(device, kernels::copy_values, width,
             {values / copied, 1, width == 1 ? std::size_t{128} : kRowGroup}, from, to);
    });
    const double moved = 2.0 * sizeof(float) * static_cast<double>(values);
    roofline.copy.push_back({moved, 1e-9 * moved / seconds});
  }
  // Values that stay as they are, so that none becomes infinite or denormal.
  roofline.fused_gflops =
      2 * arithmetic_rate(device, kernels::fuse_multiply_add, 8, 0.5f, 1.0f, effort);
  roofline.plain_gflops =
      arithmetic_rate(device, kernels::multiply_and_add, 12, 1.0f, 0.0f, effort);
  roofline.spread_atomics = atomic_rate(device, static_cast<cl_uint>(effort.atomics - 1), effort);
  roofline.contended_atomics = atomic_rate(device, 0, effort);

  const auto one = allocate<float>(device, 64);
  roofline.empty_kernel_us =
      1e6 * best_seconds(device, effort, [&] { launch(device, kernels::write_one, 1, {64}, one); });
  const LaunchCost launches = measure_launches(device, effort.tries);
  roofline.launch_us = launches.single_us;
  roofline.batched_launch_us = launches.batched_us;
  return roofline;
}

}  // namespace meniscus
