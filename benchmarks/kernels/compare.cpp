#include "kernels/compare.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/comma_separated.hpp"
#include "base/grouped.hpp"

namespace meniscus::bench {

double Difference::noise() const {
  return std::max(kLeastNoise, (before.noise_ms() + after.noise_ms()) / before.best_ms());
}

bool Difference::exceeds_noise() const { return std::abs(ratio() - 1) > noise(); }

bool Difference::is_undecided() const {
  return control > 0 && std::abs(control - 1) > std::max(kLeastNoise, control_noise);
}

const char* verdict_on(const Difference& difference) {
  if (!difference.exceeds_noise()) return "within the noise";
  if (difference.after.variant == kNative) return "control moved";
  if (difference.is_undecided()) return "undecided";
  return difference.ratio() < 1 ? "faster" : "slower";
}

std::vector<Difference> compare(const Session& before, const Session& after) {
  std::vector<Difference> differences, natives;
  for (const Result& result : after.results)
    if (const Result* old = before.find(result.kernel, result.variant, result.particles,
                                        result.width, result.height)) {
      differences.push_back({*old, result});
      if (result.variant == kNative) natives.push_back(differences.back());
    }
  const auto by_ratio = [](const Difference& a, const Difference& b) {
    return a.ratio() < b.ratio();
  };
  const auto middle = natives.begin() + static_cast<std::ptrdiff_t>(natives.size() / 2);
  std::nth_element(natives.begin(), middle, natives.end(), by_ratio);
  for (Difference& difference : differences) {
    if (difference.after.variant == kNative || natives.empty()) continue;
    const Result *old = before.native_of(difference.before),
                 *now = after.native_of(difference.after);
    const Difference own = old && now ? Difference{*old, *now} : *middle;
    difference.control = own.ratio();
    difference.control_noise = own.noise();
  }
  return differences;
}

namespace {

// Devices against the first one, which may have the same name, as two cards of a kind do: with as
// many threads where the first was measured so, else with all they have. Sessions of one device
// follow each other, each with fewer threads.
std::vector<SessionPair> pair_devices(const BenchRun& run) {
  std::vector<SessionPair> pairs;
  std::vector<const Session*> first;
  const Session* previous = nullptr;
  for (const Session& session : run.sessions) {
    const bool fewer =
        previous && previous->device == session.device && session.threads < previous->threads;
    if (first.empty() || (fewer && previous == first.back())) {
      first.push_back(&session);
    } else {
      const auto same = std::find_if(first.begin(), first.end(), [&](const Session* candidate) {
        return candidate->threads == session.threads;
      });
      if (same != first.end())
        pairs.push_back({*same, &session});
      else if (!fewer)
        pairs.push_back({first.front(), &session});
    }
    previous = &session;
  }
  return pairs;
}

}  // namespace

std::vector<SessionPair> pair_sessions(const BenchRun* before, const BenchRun& after) {
  std::vector<SessionPair> pairs;
  if (!before) return pair_devices(after);
  std::set<const Session*> taken;
  std::vector<const Session*> partner(after.sessions.size(), nullptr);
  enum Likeness { kSame, kSameThreads, kAny };
  for (const Likeness likeness : {kSame, kSameThreads, kAny})
    for (std::size_t k = 0; k < after.sessions.size(); ++k)
      for (const Session& old : before->sessions) {
        const Session& session = after.sessions[k];
        const bool alike =
            likeness == kAny || (old.threads == session.threads &&
                                 (likeness == kSameThreads || old.device == session.device));
        if (partner[k] || taken.count(&old) || !alike) continue;
        partner[k] = &old;
        taken.insert(&old);
      }
  for (std::size_t k = 0; k < after.sessions.size(); ++k)
    if (partner[k]) pairs.push_back({partner[k], &after.sessions[k]});
  return pairs;
}

bool has_any(const BenchRun& run, const std::vector<std::string>& kernels,
             const std::vector<long long>& particles, int width, int height) {
  for (const Session& session : run.sessions)
    for (const std::string& kernel : kernels)
      for (const long long count : particles)
        if (session.find(kernel, kDevice, count, width, height)) return true;
  return false;
}

std::string sizes_of(const BenchRun& run) {
  std::vector<std::string> sizes;
  for (const Session& session : run.sessions)
    for (const Result& r : session.results) {
      const std::string size = grouped(r.particles) + " particles at " + std::to_string(r.width) +
                               "x" + std::to_string(r.height);
      if (std::find(sizes.begin(), sizes.end(), size) == sizes.end()) sizes.push_back(size);
    }
  return sizes.empty() ? "none" : comma_separated(sizes);
}

std::string title_of(const Session& session) {
  const std::string title =
      session.file.empty() ? session.device : session.file + ": " + session.device;
  return session.threads == 0 ? title : title + ", " + counted(session.threads, "thread");
}

}  // namespace meniscus::bench
