#include "verify/trace.hpp"

#include <algorithm>
#include <regex>

#include "content_hash.hpp"
#include "device/kernel_sources.hpp"
#include "printed.hpp"
#include "verify/bits.hpp"

namespace meniscus::verify {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Lists that atomics fill in any order: the kernels that read them must not care. Bytes of an
// entry.
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

// Such a launch is none: nothing is enqueued.
bool empty(const KernelLaunch& launch) { return launch.range.nx == 0 || launch.range.ny == 0; }

std::vector<std::uint32_t> words_of(const Bytes& bytes) {
  std::vector<std::uint32_t> words((bytes.size() + 3) / 4);
  std::copy(bytes.begin(), bytes.end(), reinterpret_cast<std::uint8_t*>(words.data()));
  return words;
}

// How two contents of a buffer differ, in words.
std::string difference(const Bytes& expected, const Bytes& found, bool floats, double& ulp) {
  if (expected.size() != found.size())
    return std::to_string(found.size()) + " bytes for " + std::to_string(expected.size());
  const Reading reading = floats ? Reading::floats : Reading::integers;
  const std::vector<std::uint32_t> wanted = words_of(expected), own = words_of(found);
  const Difference d = compare(wanted, own, reading);
  if (d.count == 0) return "only the bits of what is no number differ";
  ulp = std::max(ulp, d.ulp);
  std::string text = grouped(d.count) + " of ";
  text += grouped(d.of) + " values differ, the first at ";
  text += std::to_string(d.first) + ": found " + hex(own[d.first], reading);
  text += ", wanted " + hex(wanted[d.first], reading);
  return text;
}

}  // namespace

const std::vector<std::string>& argument_names(const std::string& file, const std::string& kernel) {
  // Every launch asks for them, so each text is read once.
  static std::map<std::pair<std::string, std::string>, std::vector<std::string>> known;
  const auto [place, first] = known.try_emplace({file, kernel});
  std::vector<std::string>& names = place->second;
  if (!first) return names;
  const std::string own = file.substr(file.rfind(' ') + 1);
  for (const KernelSource& source : kernel_sources()) {
    if (source.file != own) continue;
    std::string text = std::regex_replace(std::string(source.text), std::regex("//[^\n]*"), "");
    std::smatch head;
    if (!std::regex_search(text, head,
                           std::regex("kernel\\s+void\\s+" + kernel + "\\s*\\(([^)]*)\\)")))
      break;
    const std::string list = head[1];
    const std::regex last("(\\w+)\\s*(,|$)");
    for (std::sregex_iterator name(list.begin(), list.end(), last), end; name != end; ++name)
      names.push_back((*name)[1]);
  }
  return names;
}

Tracer::Tracer(Device& device, std::map<std::uint64_t, Bytes>* values)
    : device_(device), values_(values) {
  device.state().observer = this;
  device.state().pool->reuse(false);
}

Tracer::Tracer(Device& device, const Trace& canonical, const std::map<std::uint64_t, Bytes>& values)
    : Tracer(device, nullptr) {
  canonical_ = &canonical;
  known_ = &values;
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
  if (canonical_ && other_launches_.empty()) compare(launch, found);
}

void Tracer::compare(const KernelLaunch& launch, const std::vector<Bytes>& found) {
  KernelFindings& findings = findings_[launch.kernel];
  const std::size_t place = trace_.size() - 1;
  const TracedLaunch& own = trace_.back();
  const auto where = [&] {
    return "launch " + std::to_string(place + 1) + " of " + std::to_string(canonical_->size()) +
           (own.stage.empty() ? "" : ", stage " + own.stage);
  };
  if (place >= canonical_->size() || (*canonical_)[place].kernel != launch.kernel) {
    other_launches_ = where() + " is " + launch.kernel + ", wanted " +
                      (place < canonical_->size() ? (*canonical_)[place].kernel : "none");
    return;
  }
  const TracedLaunch& wanted = (*canonical_)[place];
  if (wanted.inputs != own.inputs) {
    ++findings.unknown;
    return;
  }
  ++findings.launches;
  if (wanted.written == own.written) return;

  std::string what;
  bool repaired = true;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto at = [&](const std::vector<Written>& written) -> const Written* {
      for (const Written& w : written)
        if (w.argument == static_cast<int>(k)) return &w;
      return nullptr;
    };
    const Written *of_wanted = at(wanted.written), *of_own = at(own.written);
    if (!of_wanted && !of_own) continue;
    if (of_wanted && of_own && of_wanted->hash == of_own->hash) continue;
    // Inputs were the same, so what the canonical launch left alone is as it was before.
    const Bytes* expected = of_wanted ? nullptr : &contents_[k];
    if (of_wanted)
      if (const auto known = known_->find(of_wanted->hash); known != known_->end())
        expected = &known->second;
    const bool floats = launch.arguments[k].floats;
    if (what.empty()) {
      what = "argument " + names_[k] + ": ";
      what += expected ? difference(*expected, found[k], floats, findings.ulp) : "other bits";
    } else if (expected) {
      difference(*expected, found[k], floats, findings.ulp);
    }
    if (expected && expected->size() == found[k].size())
      device_.state().write_bytes(*launch.arguments[k].buffer, expected->data(), expected->size());
    else
      repaired = false;
  }
  if (findings.differing++ == 0) {
    findings.stage = own.stage;
    findings.first = where() + ", " + what;
  }
  if (first_difference_.empty()) {
    first_difference_ = "stage " + own.stage + ", kernel " + launch.kernel + " (";
    first_difference_ += where() + "): " + what;
  }
  if (repaired) return;
  for (std::size_t later = place + 1; later < canonical_->size(); ++later) {
    KernelFindings& left_out = findings_[(*canonical_)[later].kernel];
    if (left_out.stage.empty()) left_out.stage = (*canonical_)[later].stage;
    ++left_out.unknown;
  }
  throw BeyondRepair();
}

std::string Tracer::other_launches() const {
  if (!other_launches_.empty() || !canonical_ || trace_.size() == canonical_->size())
    return other_launches_;
  return std::to_string(trace_.size()) + " launches, wanted " + std::to_string(canonical_->size());
}

}  // namespace meniscus::verify
