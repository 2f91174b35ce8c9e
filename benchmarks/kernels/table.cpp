#include "kernels/table.hpp"

#include <algorithm>

#include "base/printed.hpp"
#include "frame/process.hpp"

namespace meniscus::bench {

std::string ratio_text(double ratio) { return ratio > 0 ? printed("%.2f", ratio) : "-"; }

std::string count_text(double value) { return value > 0 ? three_digits(value) : "-"; }

std::string frame_of(const Result& result) {
  return grouped(result.particles) + " particles at " + std::to_string(result.width) + "x" +
         std::to_string(result.height);
}

std::string roofline_line(const Roofline& roofline) {
  std::string line = "copies";
  for (const CopyRate& copy : roofline.copy)
    line += (&copy == &roofline.copy.front() ? " " : ", ") + three_digits(copy.gb_per_s) +
            " GB/s in " + size_of(static_cast<std::uint64_t>(copy.bytes));
  return line + "; " + three_digits(roofline.fused_gflops) + " GFLOP/s fused, " +
         three_digits(roofline.plain_gflops) + " plain; a launch " +
         three_digits(roofline.launch_us) + " us, in a batch " +
         three_digits(roofline.batched_launch_us) + " us; atomic minima " +
         with_prefix(1e9 * roofline.spread_atomics) + "/s, on one word " +
         with_prefix(1e9 * roofline.contended_atomics) + "/s";
}

namespace {

std::string disturbance(const Session& session) {
  return other_work_warning(session.other_work, "times and roofline");
}

}  // namespace

std::vector<std::string> warnings_on(const Session& session, const Session* one_thread) {
  std::vector<std::string> warnings;
  if (!session.unfinished.empty()) warnings.push_back("UNFINISHED: " + session.unfinished);
  if (session.disturbed()) warnings.push_back(disturbance(session));
  const bool several = session.kind == "CPU" && session.threads > 1 && session.processors > 1;
  if (one_thread && several) {
    const double gain = session.roofline.peak_gflops() / one_thread->roofline.peak_gflops();
    if (gain < kLeastGain)
      warnings.push_back(
          printed("%d threads computed only %.2f times as fast as one: they did not "
                  "run at once, and shares of the roofline are too large",
                  session.threads, gain));
  }
  const std::string configure =
      "not compiled for this processor (configure with -DMENISCUS_NATIVE_BENCHMARKS=ON)";
  if (session.without_native)
    warnings.push_back("native versions were left out: they are " + configure +
                       ", so that no verdict is drawn from them (--json and --compare run them, as "
                       "the control where runs are compared)");
  const bool has_native = std::any_of(session.results.begin(), session.results.end(),
                                      [](const Result& r) { return r.variant == kNative; });
  if (has_native && !session.native_flags)
    warnings.push_back("native versions are " + configure +
                       " and slower than they could be: they are marked native*, kernels are not "
                       "measured by them, and no verdict is drawn from them");
  return warnings;
}

std::string variant_text(const Session& session, const Result& result) {
  return result.variant + (result.variant == kNative && !session.native_flags ? "*" : "");
}

bool has_native(const Session& session) {
  return std::any_of(session.results.begin(), session.results.end(),
                     [&](const Result& r) { return session.against_native(r) > 0; });
}

std::vector<Difference> changed_first(std::vector<Difference> differences) {
  std::stable_partition(differences.begin(), differences.end(),
                        [](const Difference& d) { return d.exceeds_noise(); });
  return differences;
}

std::string share_text(const Result& result, const Share& share) {
  if (result.whole_stage) return "stage, wall time";
  if (!share.counted()) return "not counted";
  const std::string part = printed("%.0f%% of ", 100 * share.value);
  const std::string ceiling = three_digits(share.ceiling);
  if (share.limit == "memory") return part + ceiling + " GB/s";
  if (share.limit == "arithmetic") return part + ceiling + " GFLOP/s";
  if (share.limit == "atomics") return part + with_prefix(1e9 * share.ceiling) + " atomics/s";
  return part + "a launch, " + ceiling + " us";
}

std::string results_table(const BenchRun& run) {
  std::string text;
  for (const Session& session : run.sessions) {
    text += title_of(session) + " (" + session.platform + ", driver " + session.driver + ")";
    if (!session.results.empty()) {
      const Result& r = session.results.front();
      text += ", images of " + std::to_string(r.width) + "x" + std::to_string(r.height);
    }
    text += "\n  " + roofline_line(session.roofline) + "\n";
    for (const std::string& warning : warnings_on(session, one_thread_of(run, session)))
      text += "  warning: " + warning + "\n";
    text += "\n";
    const bool native = has_native(session);
    text += printed("%-20s %-7s %10s %9s %6s %18s %7s %8s %16s%s\n", "kernel", "variant",
                    "particles", "ms", "noise", "rate", "GB/s", "GFLOP/s", "of roofline",
                    native ? "  x native" : "");
    for (const Result& r : session.results) {
      const Share share = share_of_roofline(r, session.roofline);
      text += printed(
          "%-20s %-7s %10s %9s %5.0f%% %18s %7s %8s %16s%s\n", r.kernel.c_str(),
          variant_text(session, r).c_str(), grouped(r.particles).c_str(),
          three_digits(r.best_ms()).c_str(), 100 * r.noise_ms() / r.best_ms(),
          (with_prefix(r.rate()) + " " + r.unit + "/s").c_str(), three_digits(r.gb_per_s()).c_str(),
          count_text(r.gflops()).c_str(),
          share.counted() ? printed("%.0f%% %s", 100 * share.value, share.limit.c_str()).c_str()
                          : share_text(r, share).c_str(),
          native ? printed(" %9s", ratio_text(session.against_native(r)).c_str()).c_str() : "");
      if (!r.note.empty()) text += "  note: " + r.note + "\n";
    }
    text += "\n";
  }
  return text;
}

std::vector<Verdict> farthest_first(std::vector<Verdict> verdicts) {
  // How much of what would be near enough is reached, by the better of the two measures.
  const auto reached = [](const Verdict& v) {
    return std::max(v.share.value / kGoodShare, v.against_native() / kGoodAgainstNative);
  };
  std::stable_sort(verdicts.begin(), verdicts.end(), [&](const Verdict& a, const Verdict& b) {
    // Last what nothing was measured of that would tell.
    const auto rank = [](const Verdict& v) {
      return v.near_limit() ? 2 : !v.open() ? 0 : v.share.counted() ? 1 : 3;
    };
    return rank(a) != rank(b) ? rank(a) < rank(b) : reached(a) < reached(b);
  });
  return verdicts;
}

namespace {

const char* verdict_in_words(const Verdict& v) {
  return v.share.value >= kGoodShare               ? "at the roofline"
         : v.against_native() >= kFasterThanNative ? "faster than native"
         : v.near_limit()                          ? "as native"
         : v.open()                                ? "open"
                                                   : "slower";
}

}  // namespace

std::string verdict_table(const BenchRun& run) {
  const bool any_native = std::any_of(run.sessions.begin(), run.sessions.end(), has_native);
  std::string text = printed(
      "Verdicts are for the largest frame, on all threads. Noise: how far the fastest quarter\n"
      "of the launches reaches above the fastest one. At the roofline: at least %.0f%% of it.\n",
      100 * kGoodShare);
  if (any_native)
    text += printed(
        "x native: the speed over that of the native version, on one thread and on all (n).\n"
        "As native: x native is at least %.1f, on one thread and on all, as far as both were\n"
        "measured; faster than native: at least %.2f. Slower: below both and below the roofline.\n",
        kGoodAgainstNative, kFasterThanNative);
  text += "Open: below the roofline, and no native version tells whether more is possible.\n\n";
  const std::vector<Verdict> verdicts = farthest_first(judge(run));
  for (const Session& session : run.sessions) {
    const bool judged = std::any_of(verdicts.begin(), verdicts.end(),
                                    [&](const Verdict& v) { return v.session == &session; });
    if (!judged) continue;
    text += title_of(session) + "\n";
    const bool native = has_native(session);
    text += printed("%-20s %10s %9s %6s %24s%s  %s\n", "kernel", "particles", "ms", "noise",
                    "of roofline", native ? "  x native, 1  x native, n" : "", "verdict");
    for (const Verdict& v : verdicts) {
      if (v.session != &session) continue;
      const std::string ratios = native ? printed(" %12s %12s", ratio_text(v.against_one).c_str(),
                                                  ratio_text(v.against_all).c_str())
                                        : std::string();
      text +=
          printed("%-20s %10s %9s %5.0f%% %24s%s  %s\n", v.result->kernel.c_str(),
                  grouped(v.result->particles).c_str(), three_digits(v.result->best_ms()).c_str(),
                  100 * v.result->noise_ms() / v.result->best_ms(),
                  share_text(*v.result, v.share).c_str(), ratios.c_str(), verdict_in_words(v));
    }
    text += "\n";
  }
  return text;
}

std::string roofline_ratio(const SessionPair& pair) {
  const Roofline &before = pair.before->roofline, &after = pair.after->roofline;
  const auto of = [](double b, double a) { return ratio_text(b > 0 ? a / b : 0); };
  std::string copies;
  for (std::size_t k = 0; k < std::min(before.copy.size(), after.copy.size()); ++k)
    copies += (k == 0 ? "" : ", ") + of(before.copy[k].gb_per_s, after.copy[k].gb_per_s);
  return "roofline, after / before: copies " + copies + "; arithmetic " +
         of(before.peak_gflops(), after.peak_gflops()) + "; atomic minima " +
         of(before.spread_atomics, after.spread_atomics);
}

std::string change_summary(const std::vector<Difference>& differences) {
  std::size_t times = 0, changed = 0, undecided = 0;
  for (const Difference& d : differences) {
    if (d.after.variant == kNative) continue;
    ++times;
    if (!d.exceeds_noise()) continue;
    ++(d.is_undecided() ? undecided : changed);
  }
  std::string text = std::to_string(changed) + " of " + counted(times, "kernel time") +
                     " changed by more than the noise";
  if (undecided > 0)
    text += ", " + std::to_string(undecided) + " undecided: the native version changed, too";
  return text;
}

std::string comparison_table(const std::vector<SessionPair>& pairs) {
  std::string text;
  for (const SessionPair& pair : pairs) {
    text += "before: " + title_of(*pair.before) + "\nafter:  " + title_of(*pair.after) + "\n\n";
    for (const Session* session : {pair.before, pair.after}) {
      const std::string which = session == pair.before ? "before: " : "after:  ";
      if (!session->unfinished.empty()) text += which + "UNFINISHED: " + session->unfinished + "\n";
      if (session->disturbed()) text += which + disturbance(*session) + "\n";
    }
    text += roofline_ratio(pair) + "\n";
    const std::vector<Difference> differences = changed_first(compare(*pair.before, *pair.after));
    if (differences.empty()) {
      text += std::string(kNothingInCommon) + "\n\n";
      continue;
    }
    text += printed("%-20s %-7s %10s %10s %10s %8s %8s  %s\n", "kernel", "variant", "particles",
                    "before ms", "after ms", "ratio", "noise", "verdict");
    for (const Difference& d : differences)
      text +=
          printed("%-20s %-7s %10s %10s %10s %8.2f %7.0f%%  %s\n", d.after.kernel.c_str(),
                  variant_text(*pair.after, d.after).c_str(), grouped(d.after.particles).c_str(),
                  three_digits(d.before.best_ms()).c_str(), three_digits(d.after.best_ms()).c_str(),
                  d.ratio(), 100 * d.noise(), verdict_on(d));
    text += "\n" + change_summary(differences) + "\n\n";
  }
  return text;
}

}  // namespace meniscus::bench
