#include "verify/run.hpp"

#include <algorithm>
#include <chrono>
#include <set>

#include "base/content_hash.hpp"
#include "base/elapsed.hpp"
#include "program/wording.hpp"
#include "verify/arithmetic.hpp"
#include "verify/cases.hpp"
#include "verify/flaws.hpp"
#include "verify/limits.hpp"
#include "verify/probe.hpp"
#include "verify/results.hpp"
#include "verify/trace.hpp"
#include "verify/with_discs.hpp"

namespace meniscus::verify {
namespace {

using Clock = std::chrono::steady_clock;

const Trace& canonical_trace(const std::string& key) {
  static const Trace none;
  const auto found = shipped_canonical().traces.find(key);
  return found == shipped_canonical().traces.end() ? none : found->second;
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
                   const Settings& settings, const Report& report) {
  const AsVariant as(device, variant);
  if (settings.reproducers)
    settings.reproducers->set_case(variant.name, which.name + ", " + which.size);
  Tracer tracer(device, canonical_trace(key_of(which, variant.width)), shipped_canonical().values,
                {settings.repeat, settings.reproducers});
  const auto report_row = [&](Row row) {
    row.group = "kernel";
    row.variant = variant.name;
    row.size = which.name + ", " + which.size;
    row.required = required;
    report(std::move(row));
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
    if (wanted(settings, kernel)) report_row(row_of(kernel, found));
  if (error.empty() && whole) error = tracer.other_launches();
  if (error.empty()) return;
  Row row;
  row.kernel = which.name;
  row.result = Result::fail;
  row.reason = error;
  row.ms = milliseconds_since(begin);
  report_row(row);
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
                 const Settings& settings, const Report& report) {
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
  report(std::move(row));
}

// A stage against double precision: not watched, because what is watched is put right.
void check_references(Device& device, const StageCase& stage, const Variant& variant, bool required,
                      const Settings& settings, const Report& report) {
  const AsVariant as(device, variant);
  for (const int size : stage.sizes) {
    if (size != stage.sizes.front() && !settings.full) break;
    const auto begin = Clock::now();
    const std::vector<ReferenceError> errors = stage.run(device, size);
    const double ms =
        milliseconds_since(begin) / static_cast<double>(std::max<std::size_t>(1, errors.size()));
    for (const ReferenceError& error : errors) {
      if (!wanted(settings, error.kernel)) continue;
      report({.group = "reference",
              .kernel = error.kernel,
              .variant = variant.name,
              .size =
                  std::string(stage.stage) + ", size " + std::to_string(size) + ", " + error.output,
              .result = error.ulp <= error.allowed ? Result::pass : Result::fail,
              .ulp = error.ulp,
              .reason = std::string("stage ") + stage.stage + ": " + error_in_words(error.ulp) +
                        " of " + error_in_words(error.allowed) + " allowed",
              .ms = ms,
              .required = required});
    }
  }
}

bool launches_wanted(const Settings& settings, const Trace& trace) {
  return std::any_of(trace.begin(), trace.end(),
                     [&](const TracedLaunch& launch) { return wanted(settings, launch.kernel); });
}

void add_probes(const Settings& settings, std::vector<Item>& items) {
  items.push_back({"probe", "probes of single values", "", "", true, probe_expressions});
  items.push_back({"probe", "probes of memory and work-items", "", "", true, probe_execution});
  items.push_back({"limit", "limits", "", "", true,
                   [full = settings.full](Device& device, const Report& report) {
                     probe_limits(device, full, report);
                   }});
}

// Whether a case launches one of the kernels that are asked for.
bool is_asked_for(const Settings& settings, const Case& which, const Variant& variant) {
  return settings.kernels.empty() ||
         launches_wanted(settings, canonical_trace(key_of(which, variant.width)));
}

void add_kernels(const Settings& settings, int device_width, std::vector<Item>& items) {
  for (const Variant& variant : variants())
    for (const Case& which : kernel_cases()) {
      if (!which.small && !settings.full) continue;
      if (!is_asked_for(settings, which, variant)) continue;
      const bool required = variant.width == device_width;
      items.push_back(
          {"kernel", "kernels of " + which.name + ", " + variant.name, variant.name,
           which.name + ", " + which.size, required,
           [&which, &variant, required, settings](Device& device, const Report& report) {
             check_kernels(device, which, variant, required, settings, report);
           }});
    }
}

void add_references(const Settings& settings, int device_width, std::vector<Item>& items) {
  for (const Variant& variant : variants()) {
    if (variant.group != kRowGroup) continue;  // a stage's values do not depend on its groups
    for (const StageCase& stage : stage_cases()) {
      if (!is_asked_for(settings, case_of(stage, stage.sizes.front()), variant)) continue;
      const bool required = variant.width == device_width;
      items.push_back(
          {"reference", std::string("references of ") + stage.stage + ", " + variant.name,
           variant.name, stage.stage, required,
           [&stage, &variant, required, settings](Device& device, const Report& report) {
             check_references(device, stage, variant, required, settings, report);
           }});
    }
  }
}

void add_frames(const Settings& settings, int device_width, std::vector<Item>& items) {
  for (const Scene& frame : whole_frames())
    if (frame.small || settings.full)
      for (const Method method : frame.methods)
        for (const DiscForm discs : {DiscForm::bins, DiscForm::minima}) {
          if (discs == DiscForm::minima && !is_drawn_both_ways(method)) continue;
          items.push_back({"frame", frame_key(frame, method), frame_variant(device_width, discs),
                           frame_key(frame, method), true,
                           [&frame, method, discs, settings](Device& device, const Report& report) {
                             check_frame(device, frame, method, discs, settings, report);
                           }});
        }
}

}  // namespace

std::vector<Item> items_of(const Settings& settings, int device_width) {
  std::vector<Item> items;
  const bool all = settings.kernels.empty();
  if (all) add_probes(settings, items);
  // Kernels that are watched come first: what they leave wrong is put right or not worked on, where
  // the stages against double precision would go on and might crash.
  add_kernels(settings, device_width, items);
  add_references(settings, device_width, items);
  if (!all) return items;
  add_frames(settings, device_width, items);
  // Last: they are known to crash some drivers.
  for (Item& item : flaw_items()) items.push_back(std::move(item));
  return items;
}

Row row_of(const Item& item, const std::string& kernel, Result result, const std::string& reason) {
  return {.group = item.group,
          .kernel = kernel,
          .variant = item.variant,
          .size = item.size,
          .result = result,
          .reason = reason,
          .required = item.required};
}

void run_item(const Item& item, Device& device, const Report& report) {
  try {
    item.run(device, report);
  } catch (const KernelLeftOut& left_out) {
    device.state().stage.clear();
    report(row_of(item, item.name, Result::skip, left_out.what()));
  } catch (const std::exception& error) {
    device.state().stage.clear();
    report(row_of(item, item.name, Result::fail, words_of(error)));
  }
}

std::vector<std::string> known_kernels() {
  std::set<std::string> names;
  for (const auto& [key, trace] : shipped_canonical().traces)
    for (const TracedLaunch& launch : trace) names.insert(launch.kernel);
  return {names.begin(), names.end()};
}

}  // namespace meniscus::verify
