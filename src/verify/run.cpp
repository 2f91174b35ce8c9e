#include "verify/run.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <set>

#include "base/content_hash.hpp"
#include "base/elapsed.hpp"
#include "base/printed.hpp"
#include "device/probe.hpp"
#include "meniscus/meniscus.hpp"
#include "prepare/gather.hpp"
#include "program/wording.hpp"
#include "stages/project.hpp"
#include "stages/visible.hpp"
#include "stages/whitewater.hpp"
#include "verify/arithmetic.hpp"
#include "verify/flaws.hpp"
#include "verify/limits.hpp"
#include "verify/references.hpp"
#include "verify/results.hpp"
#include "verify/scenes.hpp"
#include "verify/trace.hpp"
#include "verify/with_discs.hpp"

namespace meniscus::verify {
namespace {

using Clock = std::chrono::steady_clock;

/// How the kernels are built and launched. All variants of a width have the same launches.
struct Variant {
  std::string name;
  int width;
  bool wide;                  // vectors of 16 where they are kept busy (Device::State::wide_width)
  std::size_t group;          // of rows of work-items
  std::size_t largest_group;  // that the device is taken to allow; 0: its own
};

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all{{"width 8", 8, false, kRowGroup, 0},
                                        {"width 1", 1, false, kRowGroup, 0},
                                        {"width 8 or 16, groups of 16", 8, true, 16, 64},
                                        {"width 1, groups of 32", 1, false, 32, 64}};
  return all;
}

/// Sets a device to a variant while it lives.
class AsVariant {
 public:
  AsVariant(Device& device, const Variant& variant)
      : state_(device.state()),
        width_(state_.vector_width),
        wide_(state_.wide),
        row_group_(state_.row_group),
        discs_(state_.discs),
        largest_group_(state_.info.largest_group) {
    state_.vector_width = variant.width;
    state_.wide = variant.wide;
    state_.row_group = variant.group;
    state_.discs = DiscForm::bins;  // what draws by minima has cases of its own
    if (variant.largest_group > 0)
      state_.info.largest_group = std::min<std::uint64_t>(largest_group_, variant.largest_group);
  }
  ~AsVariant() {
    state_.vector_width = width_;
    state_.wide = wide_;
    state_.row_group = row_group_;
    state_.discs = discs_;
    state_.info.largest_group = largest_group_;
  }
  AsVariant(const AsVariant&) = delete;
  AsVariant& operator=(const AsVariant&) = delete;

 private:
  Device::State& state_;
  int width_;
  bool wide_;
  std::size_t row_group_;
  DiscForm discs_;
  std::uint64_t largest_group_;
};

/// Something that launches kernels, always the same ones.
struct Case {
  std::string name, size;
  bool small, values;  // values: the canonical ones are shipped, not only their hashes
  std::function<void(Device&)> run;
};

std::string key_of(const Case& which, int width) {
  return which.name + ", " + which.size + ", width " + std::to_string(width);
}

// The passes over particles that stream (stream.cl).
void run_stream(Device& device, const Scene& scene) {
  device.state().stage = "stream";
  const auto source = source_of(scene.particles);
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  // All in one part: the next one would find what the last one left in the list, in any order.
  const std::size_t all = scene.particles.size();
  const FrontMap map = find_fronts(device, view, *source, all, 2, 4, 2, 8, 8, 4, 0.8);
  select_near(device, view, *source, all, map, {}, [](const auto&, const auto&) {});
  device.state().stage.clear();
}

// Who is seen (visible.cl, bins.cl), of so many that work-items meet in the atomics.
void run_visible(Device& device, const Scene& scene) {
  device.state().stage = "visible";
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  const WorldParticles world{
      scene.particles.x, scene.particles.y, scene.particles.z, {}, false, {}};
  const Projected projected = project_particles(view, world, 2);
  std::vector<std::int32_t> all(projected.size());
  std::iota(all.begin(), all.end(), 0);
  find_visible(device, view, projected, all, {}, 0);
  device.state().stage.clear();
}

// Sums of whitewater, of so many that work-items meet in all of them; velocities are positions.
void run_whitewater(Device& device, const Scene& scene) {
  device.state().stage = "whitewater";
  const View view = make_view(scene.camera, scene.particles.particle_radius, {0, 0, 0});
  const auto x = upload(device, scene.particles.x), y = upload(device, scene.particles.y),
             z = upload(device, scene.particles.z);
  const auto radius = upload(device, std::vector<float>(x.size, 0.3f));
  const std::vector<float> depth(pixel_grid(view).size(), world_depth(view, 450));
  const WhitewaterType type = WhitewaterType::bubble;
  const WhitewaterSums sums = no_whitewater(device, view, true, true);
  draw_whitewater(device, view, {x, y, z, radius, x, y, z}, x.size,
                  shown_depths(device, view, type, depth, {}, 1), sums);
  finish_whitewater(device, view, type, sums);
  device.state().stage.clear();
}

Case case_of(const StageCase& stage, int size) {
  const bool least = size == stage.sizes.front();
  return {std::string("stage ") + stage.stage, "size " + std::to_string(size), least, least,
          [&stage, size](Device& device) { stage.run(device, size); }};
}

// Two work-items that race do not collide every time.
constexpr int kStormRounds = 6;

const std::vector<Case>& kernel_cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> cases;
    for (const Scene& scene : kernel_scenes()) {
      for (const Method method : scene.methods)
        cases.push_back({to_string(method) + " on " + scene.name, scene.size, scene.small,
                         scene.small, [&scene, method](Device& device) {
                           extract(device, scene.particles, scene.camera,
                                   parameters_of(scene, method));
                         }});
      const bool storm = scene.methods.empty();
      if (scene.particles.size() > 1)
        cases.push_back({"stream on " + scene.name, scene.size, scene.small, scene.small,
                         [&scene, storm](Device& device) {
                           for (int k = 0; k < (storm ? kStormRounds : 1); ++k)
                             run_stream(device, scene);
                         }});
      if (storm)
        cases.push_back(
            {"whitewater on " + scene.name, scene.size, false, false, [&scene](Device& device) {
               for (int k = 0; k < kStormRounds; ++k) run_whitewater(device, scene);
             }});
      if (storm)
        for (const DiscForm form : {DiscForm::bins, DiscForm::minima})
          cases.push_back({form == DiscForm::bins ? "visible on " + scene.name
                                                  : "visible by minima on " + scene.name,
                           scene.size, false, false, [&scene, form](Device& device) {
                             const WithDiscs with(device, form);
                             for (int k = 0; k < kStormRounds; ++k) run_visible(device, scene);
                           }});
    }
    for (const StageCase& stage : stage_cases())
      for (const int size : stage.sizes) cases.push_back(case_of(stage, size));
    return cases;
  }();
  return all;
}

const Trace& canonical_trace(const std::string& key) {
  static const Trace none;
  const auto found = shipped_canonical().traces.find(key);
  return found == shipped_canonical().traces.end() ? none : found->second;
}

std::string error_in_words(double ulp) {
  return std::isfinite(ulp) ? three_digits(ulp) + " ulp" : "infinitely many ulp";
}

bool wanted(const Settings& settings, const std::string& kernel) {
  return settings.kernels.empty() || std::any_of(settings.kernels.begin(), settings.kernels.end(),
                                                 [&](const std::string& part) {
                                                   return kernel.find(part) != std::string::npos;
                                                 });
}

Row row_of(const std::string& kernel, const KernelFindings& found) {
  Row row;
  row.group = "kernel";
  row.kernel = kernel;
  row.ms = found.ms;
  if (found.differing > 0 || found.unsteady > 0) {
    row.result = Result::fail;
    row.ulp =
        found.ulp > 0 ? found.ulp : -1;  // of integers, or of values that are not at hand: none
    if (found.unsteady > 0) row.reason = "differs from run to run: " + found.first_unsteady;
    if (found.differing > 0) row.reason += (found.unsteady > 0 ? "; " : "") + found.first;
    if (found.differing > 1)
      row.reason += "; " + std::to_string(found.differing) + " of its " +
                    std::to_string(found.launches) + " launches differ";
    if (!found.reproducer.empty()) row.reason += "; reproducer: " + found.reproducer;
  } else if (found.launches > 0) {
    row.ulp = 0;
  } else {
    row.result = Result::skip;
    row.reason = found.left_out > 0  ? "left out: it crashed or hung before"
                 : found.unknown > 0 ? found.why_unknown
                                     : "other kernels were launched than the canonical ones";
  }
  return row;
}

void check_kernels(Device& device, const Case& which, const Variant& variant, bool required,
                   const Settings& settings, const Tell& tell) {
  const AsVariant as(device, variant);
  if (settings.reproducers)
    settings.reproducers->set_case(variant.name, which.name + ", " + which.size);
  Tracer tracer(device, canonical_trace(key_of(which, variant.width)), shipped_canonical().values,
                {settings.repeat, settings.reproducers});
  const auto report = [&](Row row) {
    row.group = "kernel";
    row.variant = variant.name;
    row.size = which.name + ", " + which.size;
    row.required = required;
    tell(std::move(row));
  };
  const auto begin = Clock::now();
  std::string error;
  bool whole = true;
  try {
    which.run(device);
  } catch (const BeyondRepair&) {
    whole = false;  // the findings say what was wrong
    device.state().stage.clear();
  } catch (const KernelLeftOut&) {
    whole = false;
    device.state().stage.clear();
  } catch (const Error& failure) {
    error = words_of(failure);
    device.state().stage.clear();
  }
  for (const auto& [kernel, found] : tracer.findings())
    if (wanted(settings, kernel)) report(row_of(kernel, found));
  if (error.empty() && whole) error = tracer.other_launches();
  if (error.empty()) return;
  Row row;
  row.kernel = which.name;
  row.result = Result::fail;
  row.reason = error;
  row.ms = milliseconds_since(begin);
  report(row);
}

std::string frame_key(const Scene& frame, Method method) {
  return "frame " + to_string(method) + " on " + frame.name;
}

std::string frame_variant(int width, DiscForm discs) {
  return "width " + std::to_string(width) +
         (discs == DiscForm::bins ? "" : std::string(", discs by ") + to_string(discs));
}

// Of those that draw discs, one for each kernel that does.
bool is_drawn_both_ways(Method method) {
  return method == Method::fit || method == Method::paper || method == Method::spheres;
}

// A frame whose hash is not the canonical one runs once more, watched.
std::string first_difference(Device& device, const Scene& frame, Method method,
                             const Settings& settings) {
  const std::string width = "width " + std::to_string(device.state().vector_width);
  if (settings.reproducers) settings.reproducers->set_case(width, frame_key(frame, method));
  const bool minima = device.state().discs == DiscForm::minima;
  const WithDiscs with(device, DiscForm::bins);  // as the canonical launches
  Tracer tracer(device, canonical_trace(frame_key(frame, method) + ", " + width),
                shipped_canonical().values, {1, settings.reproducers});
  try {
    surface_of(device, frame, method);
  } catch (const BeyondRepair&) {
    device.state().stage.clear();
  }
  if (!tracer.first_difference().empty()) return "first in " + tracer.first_difference();
  if (!tracer.other_launches().empty()) return tracer.other_launches();
  if (minima) return "drawn by bins instead of minima all launches leave the canonical bits";
  return "all launches leave the canonical bits: the host's part differs, or it differs from run "
         "to run";
}

void check_frame(Device& device, const Scene& frame, Method method, DiscForm discs,
                 const Settings& settings, const Tell& tell) {
  const WithDiscs with(device, discs);
  Row row;
  row.group = "frame";
  row.kernel = to_string(method);
  row.size = frame.name + ", " + frame.size;
  row.variant = frame_variant(device.state().vector_width, discs);
  const auto hash = [&] { return content_hash(surface_of(device, frame, method)); };
  const auto begin = Clock::now();
  const std::uint64_t found = hash();
  row.ms = milliseconds_since(begin);
  int run = 2;
  std::uint64_t again = found;
  for (; run <= settings.repeat && (again = hash()) == found;) ++run;
  const auto known = shipped_canonical().frames.find(frame_key(frame, method));
  if (again != found) {
    row.result = Result::fail;
    row.reason = "hash " + hex_digits(found) + " differs from run to run: " + hex_digits(again) +
                 " in run " + std::to_string(run);
  } else if (known == shipped_canonical().frames.end()) {
    row.result = Result::skip;
    row.reason = "this release has no hash for it; found " + hex_digits(found);
  } else if (known->second == found) {
    row.ulp = 0;
    row.reason = "hash " + hex_digits(found);
  } else {
    row.result = Result::fail;
    row.reason = "hash " + hex_digits(found) + ", wanted " + hex_digits(known->second) + "; " +
                 first_difference(device, frame, method, settings);
  }
  tell(std::move(row));
}

// A stage against double precision: not watched, because what is watched is put right.
void check_references(Device& device, const StageCase& stage, const Variant& variant, bool required,
                      const Settings& settings, const Tell& tell) {
  const AsVariant as(device, variant);
  for (const int size : stage.sizes) {
    if (size != stage.sizes.front() && !settings.full) break;
    const auto begin = Clock::now();
    const std::vector<ReferenceError> errors = stage.run(device, size);
    const double ms =
        milliseconds_since(begin) / static_cast<double>(std::max<std::size_t>(1, errors.size()));
    for (const ReferenceError& error : errors) {
      if (!wanted(settings, error.kernel)) continue;
      Row row;
      row.group = "reference";
      row.kernel = error.kernel;
      row.variant = variant.name;
      row.size = std::string(stage.stage) + ", size " + std::to_string(size) + ", " + error.output;
      row.result = error.ulp <= error.allowed ? Result::pass : Result::fail;
      row.ulp = error.ulp;
      row.reason = std::string("stage ") + stage.stage + ": " + error_in_words(error.ulp) + " of " +
                   error_in_words(error.allowed) + " allowed";
      row.ms = ms;
      row.required = required;
      tell(std::move(row));
    }
  }
}

bool launches_wanted(const Settings& settings, const Trace& trace) {
  return std::any_of(trace.begin(), trace.end(),
                     [&](const TracedLaunch& launch) { return wanted(settings, launch.kernel); });
}

}  // namespace

std::vector<Item> items_of(const Settings& settings, int device_width) {
  std::vector<Item> items;
  if (settings.kernels.empty()) {
    items.push_back({"probe", "probes of single values", "", "", true, probe_expressions});
    items.push_back({"probe", "probes of memory and work-items", "", "", true, probe_execution});
    items.push_back(
        {"limit", "limits", "", "", true, [full = settings.full](Device& device, const Tell& tell) {
           probe_limits(device, full, tell);
         }});
  }
  // Kernels that are watched come first: what they leave wrong is put right or not worked on, where
  // the stages against double precision would go on and might crash.
  for (const Variant& variant : variants())
    for (const Case& which : kernel_cases()) {
      if (!which.small && !settings.full) continue;
      if (!settings.kernels.empty() &&
          !launches_wanted(settings, canonical_trace(key_of(which, variant.width))))
        continue;
      const bool required = variant.width == device_width;
      items.push_back({"kernel", "kernels of " + which.name + ", " + variant.name, variant.name,
                       which.name + ", " + which.size, required,
                       [&which, &variant, required, settings](Device& device, const Tell& tell) {
                         check_kernels(device, which, variant, required, settings, tell);
                       }});
    }
  for (const Variant& variant : variants()) {
    if (variant.group != kRowGroup) continue;  // a stage's values do not depend on its groups
    for (const StageCase& stage : stage_cases()) {
      if (!settings.kernels.empty() &&
          !launches_wanted(settings, canonical_trace(key_of(case_of(stage, stage.sizes.front()),
                                                            variant.width))))
        continue;
      const bool required = variant.width == device_width;
      items.push_back({"reference",
                       std::string("references of ") + stage.stage + ", " + variant.name,
                       variant.name, stage.stage, required,
                       [&stage, &variant, required, settings](Device& device, const Tell& tell) {
                         check_references(device, stage, variant, required, settings, tell);
                       }});
    }
  }
  if (!settings.kernels.empty()) return items;
  for (const Scene& frame : whole_frames())
    if (frame.small || settings.full)
      for (const Method method : frame.methods)
        for (const DiscForm discs : {DiscForm::bins, DiscForm::minima}) {
          if (discs == DiscForm::minima && !is_drawn_both_ways(method)) continue;
          items.push_back({"frame", frame_key(frame, method), frame_variant(device_width, discs),
                           frame_key(frame, method), true,
                           [&frame, method, discs, settings](Device& device, const Tell& tell) {
                             check_frame(device, frame, method, discs, settings, tell);
                           }});
        }
  // Last: they are known to crash some drivers.
  for (Item& item : flaw_items()) items.push_back(std::move(item));
  return items;
}

Row row_of(const Item& item, const std::string& kernel, Result result, const std::string& reason) {
  Row row;
  row.group = item.group;
  row.kernel = kernel;
  row.variant = item.variant;
  row.size = item.size;
  row.required = item.required;
  row.result = result;
  row.reason = reason;
  return row;
}

void run_item(const Item& item, Device& device, const Tell& tell) {
  try {
    item.run(device, tell);
  } catch (const KernelLeftOut& left_out) {
    device.state().stage.clear();
    tell(row_of(item, item.name, Result::skip, left_out.what()));
  } catch (const std::exception& error) {
    device.state().stage.clear();
    tell(row_of(item, item.name, Result::fail, words_of(error)));
  }
}

Canonical record_canonical(Device& device, const std::function<void(const std::string&)>& say) {
  constexpr int kWidths[] = {1, 8};  // of vectors
  Canonical canonical;
  const DeviceInfo& info = device.info();
  canonical.origin.devices = {
      title_of(DeviceName{info.name, info.platform, info.driver, info.version})};
  // What is wrong here is not to become what all others must compute.
  for (const int width : kWidths) {
    const AsVariant as(device, {"", width, false, kRowGroup, 0});
    for (const StageCase& stage : stage_cases())
      for (const int size : stage.sizes) {
        say(std::string("references of ") + stage.stage + ", size " + std::to_string(size) +
            ", width " + std::to_string(width));
        for (const ReferenceError& error : stage.run(device, size)) {
          require(error.ulp <= error.allowed,
                  "stage " + std::string(stage.stage) + ", width " + std::to_string(width) +
                      ", size " + std::to_string(size) + ": " + error.output + " of " +
                      error.kernel + " is " + error_in_words(error.ulp) +
                      " off double precision, " + error_in_words(error.allowed) + " allowed");
          ++canonical.origin.references;
          if (error.allowed > 0)
            canonical.origin.share = std::max(canonical.origin.share, error.ulp / error.allowed);
        }
      }
  }
  constexpr std::size_t kMost = 16384;  // bytes of a buffer whose values are kept
  const auto record = [&](const std::string& key, int width, bool values, const auto& run) {
    say(key);
    const AsVariant as(device, {"", width, false, kRowGroup, 0});
    std::map<std::uint64_t, std::vector<std::uint8_t>> written;
    Tracer tracer(device, values ? &written : nullptr);
    run();
    canonical.traces[key] = tracer.trace();
    for (auto& [hash, bytes] : written)
      if (bytes.size() <= kMost) canonical.values.emplace(hash, std::move(bytes));
  };
  for (const int width : kWidths) {
    for (const Case& which : kernel_cases())
      record(key_of(which, width), width, which.values, [&] { which.run(device); });
    for (const Scene& frame : whole_frames())
      for (const Method method : frame.methods) {
        const std::string name = frame_key(frame, method);
        record(name + ", width " + std::to_string(width), width, false, [&] {
          const std::uint64_t hash = content_hash(surface_of(device, frame, method));
          const auto [place, first] = canonical.frames.emplace(name, hash);
          require(first || place->second == hash,
                  name + ": widths 1 and 8 give different bits on this device");
        });
      }
  }
  return canonical;
}

std::vector<std::string> known_kernels() {
  std::set<std::string> names;
  for (const auto& [key, trace] : shipped_canonical().traces)
    for (const TracedLaunch& launch : trace) names.insert(launch.kernel);
  return {names.begin(), names.end()};
}

}  // namespace meniscus::verify
