#include "verify/trace.hpp"

#include <sstream>

#include "base/content_hash.hpp"
#include "device/kernel_sources.hpp"

namespace meniscus::verify {
namespace {

// Such a launch is none: nothing is enqueued.
bool empty(const KernelLaunch& launch) { return launch.range.nx == 0 || launch.range.ny == 0; }

}  // namespace

const std::vector<std::string>& argument_names(const std::string& file, const std::string& kernel) {
  // Every launch asks for them.
  static std::map<std::pair<std::string, std::string>, std::vector<std::string>> known;
  const auto [place, first] = known.try_emplace({file, kernel});
  std::vector<std::string>& names = place->second;
  if (!first) return names;
  for (const KernelArguments& arguments : kernel_arguments()) {
    if (arguments.file != file || arguments.kernel != kernel) continue;
    std::istringstream all{std::string(arguments.names)};
    for (std::string name; all >> name;) names.push_back(name);
  }
  return names;
}

Tracer::Tracer(Device& device, std::map<std::uint64_t, Bytes>* values)
    : device_(device), values_(values) {
  device.state().observer = this;
  device.state().pool->reuse(false);
}

Tracer::Tracer(Device& device, const Trace& canonical, const std::map<std::uint64_t, Bytes>& values,
               Watching watching)
    : Tracer(device, nullptr) {
  canonical_ = &canonical;
  known_ = &values;
  watching_ = watching;
}

Tracer::~Tracer() {
  device_.state().observer = nullptr;
  device_.state().pool->reuse(true);
}

std::vector<Bytes> Tracer::read(const KernelLaunch& launch) {
  std::vector<Bytes> contents;
  for (const KernelLaunch::Argument& argument : launch.arguments) {
    contents.emplace_back(argument.bytes);
    if (argument.bytes > 0)
      device_.state().read_bytes(*argument.buffer, contents.back().data(), argument.bytes);
  }
  return contents;
}

void Tracer::put(const KernelLaunch& launch, const std::vector<Bytes>& contents) {
  for (std::size_t k = 0; k < contents.size(); ++k)
    if (!contents[k].empty())
      device_.state().write_bytes(*launch.arguments[k].buffer, contents[k].data(),
                                  contents[k].size());
}

void Tracer::before(const KernelLaunch& launch) {
  if (empty(launch)) return;
  names_ = argument_names(launch.file, launch.kernel);
  names_.resize(launch.arguments.size());
  contents_ = read(launch);
  std::vector<std::uint64_t> hashes;
  for (std::size_t k = 0; k < contents_.size(); ++k)
    if (launch.arguments[k].buffer) hashes.push_back(hash_of(contents_[k], names_[k]));
  trace_.push_back({device_.state().stage,
                    launch.kernel,
                    content_hash(hashes.data(), hashes.size() * sizeof hashes[0]),
                    {}});
}

void Tracer::after(const KernelLaunch& launch) {
  if (empty(launch)) return;
  const std::vector<Bytes> found = read(launch);
  for (std::size_t k = 0; k < found.size(); ++k) {
    if (found[k] == contents_[k]) continue;
    const std::uint64_t hash = hash_of(found[k], names_[k]);
    trace_.back().written.push_back({static_cast<int>(k), hash});
    if (values_) values_->emplace(hash, found[k]);
  }
  // Reading waited for the kernel, so its times are there.
  KernelFindings& findings = findings_[launch.kernel];
  const cl::Event& event = device_.state().events.back().second;
  findings.ms += 1e-6 * static_cast<double>(event.getProfilingInfo<CL_PROFILING_COMMAND_END>() -
                                            event.getProfilingInfo<CL_PROFILING_COMMAND_START>());
  if (findings.stage.empty()) findings.stage = device_.state().stage;
  run_more(launch, found);
  if (canonical_ && other_launches_.empty()) compare(launch, found);
}

std::string Tracer::place() const {
  const std::string& stage = trace_.back().stage;
  std::string text = "launch " + std::to_string(trace_.size());
  if (canonical_) text += " of " + std::to_string(canonical_->size());
  return text + (stage.empty() ? "" : ", stage " + stage);
}

std::string Tracer::named(const KernelLaunch& launch) const {
  return "kernel " + launch.kernel + " (" + place() + ")";
}

// The canonical launch in the place of this one; null: another kernel's, or of other inputs.
const TracedLaunch* Tracer::expected_launch(const KernelLaunch& launch) {
  const std::size_t at = trace_.size() - 1;
  if (at >= canonical_->size() || (*canonical_)[at].kernel != launch.kernel) {
    other_launches_ = place() + " is " + launch.kernel + ", wanted " +
                      (at < canonical_->size() ? (*canonical_)[at].kernel : "none");
    return nullptr;
  }
  if ((*canonical_)[at].inputs == trace_.back().inputs) return &(*canonical_)[at];
  std::string why = "its inputs are not the canonical ones";
  if (first_difference_.empty()) {
    why +=
        ", though each launch before it left the canonical bits: what the host makes between "
        "launches differs";
    first_difference_ = named(launch) + ": " + why;
  } else {
    why += "; the first difference: " + first_difference_;
  }
  count_unknown(trace_.back(), why);
  return nullptr;
}

void Tracer::count_unknown(const TracedLaunch& launch, const std::string& why) {
  KernelFindings& findings = findings_[launch.kernel];
  if (findings.stage.empty()) findings.stage = launch.stage;
  if (findings.unknown++ == 0) findings.why_unknown = why;
}

std::vector<Tracer::Wanted> Tracer::wanted(const KernelLaunch& launch,
                                           const TracedLaunch& canonical) const {
  std::vector<Wanted> all(launch.arguments.size());
  // Inputs were the same, so what the canonical launch left alone is as it was before.
  for (std::size_t k = 0; k < all.size(); ++k)
    if (launch.arguments[k].buffer) all[k] = {hash_of(contents_[k], names_[k]), &contents_[k]};
  for (const Written& written : canonical.written) {
    const auto known = known_->find(written.hash);
    all.at(static_cast<std::size_t>(written.argument)) = {
        written.hash, known == known_->end() ? nullptr : &known->second};
  }
  return all;
}

void Tracer::reproduce(const KernelLaunch& launch, const std::vector<Wanted>& wanted,
                       const std::vector<Bytes>& found, const std::string& what) {
  if (!watching_.reproducers || !watching_.reproducers->wants(launch.kernel)) return;
  SavedLaunch whole = saved(device_, launch, contents_, names_, !found.empty());
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    whole.arguments[k].hash = wanted[k].hash;
    if (wanted[k].values) whole.arguments[k].expected = *wanted[k].values;
  }
  findings_[launch.kernel].reproducer =
      watching_.reproducers->write(std::move(whole), place(), found, what);
}

// Nothing after this launch can be judged.
void Tracer::give_up_here(const std::string& what) {
  for (std::size_t later = trace_.size(); later < canonical_->size(); ++later)
    count_unknown((*canonical_)[later], "not run: the case ended at " + what);
  throw BeyondRepair();
}

// The launch again, from the same inputs: every run must leave the same.
void Tracer::run_more(const KernelLaunch& launch, const std::vector<Bytes>& found) {
  if (watching_.repeat < 2) return;
  Device::State& state = device_.state();
  BuiltKernel& kernel = state.kernel(launch.file, launch.kernel, launch.options);
  std::string what;
  std::vector<Bytes> left;
  for (int run = 2; run <= watching_.repeat && what.empty(); ++run) {
    put(launch, contents_);
    state.enqueue(kernel, launch.range);
    left = read(launch);
    for (std::size_t k = 0; k < left.size() && what.empty(); ++k)
      if (left[k] != found[k] && hash_of(left[k], names_[k]) != hash_of(found[k], names_[k]))
        what = "run " + std::to_string(run) + " is not like run 1: " +
               difference(names_[k], launch.arguments[k].floats, found[k], left[k]);
  }
  put(launch, found);
  if (what.empty()) return;
  KernelFindings& findings = findings_[launch.kernel];
  if (findings.unsteady++ > 0) return;
  findings.first_unsteady = place() + ", " + what;
  // What the first run left stands for what is expected, where that is not known.
  std::vector<Wanted> expected(launch.arguments.size());
  for (std::size_t k = 0; k < expected.size(); ++k)
    expected[k] = {hash_of(found[k], names_[k]), &found[k]};
  reproduce(launch, expected, left, what);
}

void Tracer::left_out(const KernelLaunch& launch) {
  if (empty(launch)) return;
  KernelFindings& findings = findings_[launch.kernel];
  if (findings.stage.empty()) findings.stage = device_.state().stage;
  ++findings.left_out;
  if (!canonical_ || !other_launches_.empty()) throw KernelLeftOut(launch.kernel);
  const TracedLaunch* const canonical = expected_launch(launch);
  const std::string what = named(launch) + ", which was left out";
  if (!canonical) give_up_here(what);
  const std::vector<Wanted> values = wanted(launch, *canonical);
  if (watching_.reproducers)
    if (const std::string how = watching_.reproducers->how_it_ended(launch.kernel); !how.empty())
      reproduce(launch, values, {}, how);
  std::vector<Bytes> contents(values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!launch.arguments[k].buffer) continue;
    if (!values[k].values || values[k].values->size() != contents_[k].size()) give_up_here(what);
    contents[k] = *values[k].values;
  }
  put(launch, contents);
  trace_.back().written = canonical->written;
}

void Tracer::compare(const KernelLaunch& launch, const std::vector<Bytes>& found) {
  const TracedLaunch* const canonical = expected_launch(launch);
  if (!canonical) return;
  KernelFindings& findings = findings_[launch.kernel];
  ++findings.launches;
  if (canonical->written == trace_.back().written) return;

  const std::vector<Wanted> values = wanted(launch, *canonical);
  std::string what;
  bool repaired = true;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const KernelLaunch::Argument& argument = launch.arguments[k];
    if (!argument.buffer || hash_of(found[k], names_[k]) == values[k].hash) continue;
    const Bytes* const expected = values[k].values;
    const std::string words =
        expected ? difference(names_[k], argument.floats, *expected, found[k], &findings.ulp)
                 : "argument " + names_[k] + ": other bits";
    if (what.empty()) what = words;
    if (expected && expected->size() == found[k].size())
      device_.state().write_bytes(*argument.buffer, expected->data(), expected->size());
    else
      repaired = false;
  }
  if (what.empty()) return;  // a list in another order
  if (findings.differing++ == 0) {
    findings.stage = trace_.back().stage;
    findings.first = place() + ", " + what;
    reproduce(launch, values, found, "");
  }
  if (first_difference_.empty()) first_difference_ = named(launch) + ": " + what;
  if (!repaired) give_up_here(first_difference_);
}

std::string Tracer::other_launches() const {
  if (!other_launches_.empty() || !canonical_ || trace_.size() == canonical_->size())
    return other_launches_;
  return std::to_string(trace_.size()) + " launches, wanted " + std::to_string(canonical_->size());
}

}  // namespace meniscus::verify
