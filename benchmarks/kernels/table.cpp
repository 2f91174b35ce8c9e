#include "kernels/table.hpp"

#include <algorithm>

#include "base/printed.hpp"

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

std::string warning_on(const Session& session) {
  if (!session.disturbed()) return "";
  return printed("other work ran beside, on %.1f processors: threads may not have run at once",
                 session.other_work);
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
    if (session.disturbed()) text += "  " + warning_on(session) + "\n";
    text += "\n";
    text +=
        printed("%-20s %-7s %10s %9s %6s %18s %7s %8s %15s %9s\n", "kernel", "variant", "particles",
                "ms", "noise", "rate", "GB/s", "GFLOP/s", "of roofline", "of native");
    for (const Result& r : session.results) {
      const Share share = share_of_roofline(r, session.roofline);
      text += printed("%-20s %-7s %10s %9s %5.0f%% %18s %7s %8s %15s %9s\n", r.kernel.c_str(),
                      r.variant.c_str(), grouped(r.particles).c_str(),
                      three_digits(r.best_ms()).c_str(), 100 * r.noise_ms() / r.best_ms(),
                      (with_prefix(r.rate()) + " " + r.unit + "/s").c_str(),
                      three_digits(r.gb_per_s()).c_str(), count_text(r.gflops()).c_str(),
                      printed("%.0f%% %s", 100 * share.value, share.limit.c_str()).c_str(),
                      ratio_text(session.against_native(r)).c_str());
      if (!r.note.empty()) text += "  note: " + r.note + "\n";
    }
    text += "\n";
  }
  return text;
}

std::vector<Verdict> farthest_first(std::vector<Verdict> verdicts) {
  // How much of what would be near enough is reached, by the better of the two measures.
  const auto reached = [](const Verdict& v) {
    double native = v.against_all;
    if (v.against_one > 0) native = std::min(native, v.against_one);
    return std::max(v.share.value / kGoodShare, native / kGoodAgainstNative);
  };
  std::stable_sort(verdicts.begin(), verdicts.end(), [&](const Verdict& a, const Verdict& b) {
    const auto rank = [](const Verdict& v) { return v.near_limit() ? 2 : v.open() ? 1 : 0; };
    return rank(a) != rank(b) ? rank(a) < rank(b) : reached(a) < reached(b);
  });
  return verdicts;
}

namespace {

const char* verdict_in_words(const Verdict& v) {
  return v.share.value >= kGoodShare ? "at the roofline"
         : v.near_limit()            ? "as native"
         : v.open()                  ? "no native version"
                                     : "slower";
}

}  // namespace

std::string verdict_table(const BenchRun& run) {
  std::string text = printed(
      "At the roofline: at least %.0f%% of it. As native: at least %.1f of the native version's "
      "speed, on one thread and on all.\nSlower: neither. Noise: how far the fastest quarter of "
      "the "
      "launches reaches above the fastest one.\n\n",
      100 * kGoodShare, kGoodAgainstNative);
  const std::vector<Verdict> verdicts = farthest_first(judge(run));
  for (const Session& session : run.sessions) {
    const bool judged = std::any_of(verdicts.begin(), verdicts.end(),
                                    [&](const Verdict& v) { return v.session == &session; });
    if (!judged) continue;
    text += title_of(session) + "\n";
    text += printed("%-20s %10s %9s %6s %12s %10s %12s %12s  %s\n", "kernel", "particles", "ms",
                    "noise", "of roofline", "limit", "of native, 1", "of native, n", "verdict");
    for (const Verdict& v : verdicts)
      if (v.session == &session)
        text += printed("%-20s %10s %9s %5.0f%% %11.0f%% %10s %12s %12s  %s\n",
                        v.result->kernel.c_str(), grouped(v.result->particles).c_str(),
                        three_digits(v.result->best_ms()).c_str(),
                        100 * v.result->noise_ms() / v.result->best_ms(), 100 * v.share.value,
                        v.share.limit.c_str(), ratio_text(v.against_one).c_str(),
                        ratio_text(v.against_all).c_str(), verdict_in_words(v));
    text += "\n";
  }
  return text;
}

std::string comparison_table(const std::vector<SessionPair>& pairs) {
  std::string text;
  for (const SessionPair& pair : pairs) {
    text += "before: " + title_of(*pair.before) + "\nafter:  " + title_of(*pair.after) + "\n\n";
    for (const Session* session : {pair.before, pair.after})
      if (session->disturbed())
        text += (session == pair.before ? "before: " : "after:  ") + warning_on(*session) + "\n";
    const std::vector<Difference> differences = compare(*pair.before, *pair.after);
    if (differences.empty()) {
      text += std::string(kNothingInCommon) + "\n\n";
      continue;
    }
    text += printed("%-20s %-7s %10s %10s %10s %8s %8s  %s\n", "kernel", "variant", "particles",
                    "before ms", "after ms", "ratio", "noise", "verdict");
    std::size_t beyond = 0;
    for (const Difference& d : differences) {
      beyond += d.exceeds_noise() && !d.is_undecided() && d.after.variant != kNative;
      text +=
          printed("%-20s %-7s %10s %10s %10s %8.2f %7.0f%%  %s\n", d.after.kernel.c_str(),
                  d.after.variant.c_str(), grouped(d.after.particles).c_str(),
                  three_digits(d.before.best_ms()).c_str(), three_digits(d.after.best_ms()).c_str(),
                  d.ratio(), 100 * d.noise(), verdict_on(d));
    }
    text += printed(
        "\n%zu of %zu differences are news: they exceed the noise, and the native version "
        "has not moved.\n\n",
        beyond, differences.size());
  }
  return text;
}

}  // namespace meniscus::bench
