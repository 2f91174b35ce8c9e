#include "kernels/page.hpp"

#include <algorithm>

#include "base/printed.hpp"
#include "kernels/table.hpp"
#include "program/page/page.hpp"

namespace meniscus::bench {
namespace {

constexpr char kStyle[] = R"css(
:root { --roof: #3c4757; }
@media (prefers-color-scheme: dark) { :root { --roof: #b4bfcc; } }
.bars { display: grid; grid-template-columns: max-content minmax(9rem, 1fr) minmax(9rem, 1fr) minmax(9rem, 1fr) max-content;
  gap: .42rem 1.3rem; align-items: center; min-width: 44rem; }
.bars.alone { grid-template-columns: max-content minmax(9rem, 1fr) max-content; min-width: 0; }
.bars .head { color: var(--soft); font-size: 12.5px; }
.bars .name { font-weight: 550; } .bars .name small { display: block; color: var(--soft); font-weight: 400; line-height: 1.2; }
.bar { position: relative; height: 20px; background: var(--grid); border-radius: 3px; }
.bar i { position: absolute; inset: 0 auto 0 0; border-radius: 3px; }
.bar b { position: absolute; top: -3px; bottom: -3px; width: 2px; background: var(--ink); opacity: .55; }
.bar span { position: absolute; left: 7px; top: 0; font-size: 12.5px; line-height: 20px; font-variant-numeric: tabular-nums; white-space: nowrap; }
.near i, .chip.near { background: var(--blue-soft); box-shadow: inset 3px 0 0 var(--blue); }
.far i, .chip.far { background: var(--orange-soft); box-shadow: inset 3px 0 0 var(--orange); }
.bar.none { background: none; color: var(--soft); }
.chip { display: inline-block; font-size: 12.5px; padding: .05rem .6rem .05rem .7rem; border-radius: 3px; }
.chip.same { color: var(--soft); }
svg.roofline { min-width: 44rem; }
.roof { stroke: var(--roof); stroke-width: 2; } .roof.second { stroke-dasharray: 6 5; stroke-width: 1.5; }
.roof-label { fill: var(--soft); } .leader { stroke: var(--soft); stroke-width: .8; }
.dot { stroke: var(--panel); stroke-width: 1.5; } circle.near { fill: var(--blue); } circle.far { fill: var(--orange); }
circle.small { opacity: .55; } .trail { fill: none; stroke-width: 1.2; opacity: .5; }
.trail.near { stroke: var(--blue); } .trail.far { stroke: var(--orange); }
.dot-label { fill: var(--ink); font-size: 13px; }
.legend b { display: inline-block; width: 2px; height: .95rem; background: var(--ink); opacity: .55; margin-right: .45rem; vertical-align: -2px; }
tr.native td { color: var(--soft); } td.note { text-align: left; color: var(--orange); }
)css";

std::string chip(const Verdict& v) {
  const std::string word = v.word();
  return "<span class=\"chip " + (v.open() ? "same" : word) + "\">" + word + "</span>";
}

// A bar of `value` (1: the whole limit) with a mark at what is good enough; the scale ends at
// `full`.
std::string bar(double value, double good, double full, const std::string& label) {
  if (!(value > 0)) return "<div class=\"bar none\"><span>" + escaped(label) + "</span></div>";
  return printed(
      "<div class=\"bar %s\"><i style=\"width:%.1f%%\"></i><b style=\"left:%.1f%%\"></b>"
      "<span>%s</span></div>",
      value >= good ? "near" : "far", 100 * std::min(1.0, value / full), 100 * good / full,
      escaped(label).c_str());
}

std::string times(double ratio) {
  return ratio > 0 ? printed("%.2f times", ratio) : "not measured";
}

std::string verdict_bars(const std::vector<Verdict>& verdicts, const Session& session) {
  const std::string all = session.threads > 1 ? printed("on %d threads", session.threads)
                                              : std::string("on all threads");
  const bool native = has_native(session);
  std::string text = std::string("<div class=\"panel\"><div class=\"bars") +
                     (native ? "" : " alone") +
                     "\">\n<div class=\"head\">kernel</div><div class=\"head\">share of the "
                     "roofline</div>";
  if (native)
    text += "<div class=\"head\">speed against native C++, 1 thread</div><div class=\"head\">" +
            all + "</div>";
  text += "<div class=\"head\"></div>\n";
  for (const Verdict& v : verdicts) {
    if (v.session != &session) continue;
    text += "<div class=\"name\">" + escaped(v.result->kernel) + "<small>" +
            three_digits(v.result->best_ms()) + " ms, " + with_prefix(v.result->rate()) + " " +
            escaped(v.result->unit) + "/s</small></div>";
    text += bar(v.share.value, kGoodShare, 1, share_text(*v.result, v.share));
    constexpr double kFull = 1.25;  // faster than that is all the same
    const double one = session.threads == 1 ? v.against_all : v.against_one;
    const double several = session.threads == 1 ? 0 : v.against_all;
    if (native)
      for (const double ratio : {one, several})
        text += bar(ratio, kGoodAgainstNative, kFull, times(ratio));
    text += "<div>" + chip(v) + "</div>\n";
  }
  return text + "</div></div>\n";
}

std::string results_rows(const Session& session) {
  std::string text =
      "<div class=\"panel\"><table><tr><th>kernel</th><th class=\"word\">variant</th>"
      "<th>particles</th><th>ms</th><th>noise</th><th>rate</th><th>GB/s</th><th>GFLOP/s</th>"
      "<th>ops/byte</th><th class=\"word\">of roofline</th><th>times native</th></tr>\n";
  for (const Result& r : session.results) {
    const Share share = share_of_roofline(r, session.roofline);
    text += printed(
        "<tr%s><td>%s</td><td class=\"word\">%s</td><td>%s</td><td>%s</td><td>%.0f %%</td><td>%s"
        "</td><td>%s</td><td>%s</td><td>%s</td><td class=\"word\">%s</td><td>%s"
        "</td></tr>\n",
        r.variant == kNative ? " class=\"native\"" : "", escaped(r.kernel).c_str(),
        escaped(variant_text(session, r)).c_str(), grouped(r.particles).c_str(),
        three_digits(r.best_ms()).c_str(), 100 * r.noise_ms() / r.best_ms(),
        escaped(with_prefix(r.rate()) + " " + r.unit + "/s").c_str(),
        three_digits(r.gb_per_s()).c_str(), count_text(r.gflops()).c_str(),
        count_text(r.intensity()).c_str(), escaped(share_text(r, share)).c_str(),
        ratio_text(session.against_native(r)).c_str());
    if (!r.note.empty())
      text += "<tr><td class=\"note\" colspan=\"11\">" + escaped(r.note) + "</td></tr>\n";
  }
  return text + "</table></div>\n";
}

std::string comparison_rows(const SessionPair& pair) {
  std::string text = "<p><strong>Before:</strong> " + escaped(title_of(*pair.before)) +
                     ". <strong>After:</strong> " + escaped(title_of(*pair.after)) + ".</p>\n";
  text += "<p>" + escaped(roofline_ratio(pair)) + ".</p>\n";
  const std::vector<Difference> differences = changed_first(compare(*pair.before, *pair.after));
  if (differences.empty()) return text + "<p>" + escaped(kNothingInCommon) + "</p>\n";
  text +=
      "<div class=\"panel\"><table><tr><th>kernel</th><th class=\"word\">variant</th>"
      "<th>particles</th><th>before, ms</th><th>after, ms</th><th>after / before</th>"
      "<th>noise</th><th class=\"word\"></th></tr>\n";
  for (const Difference& d : differences) {
    const char* const kind = !d.exceeds_noise() ? "same" : d.ratio() < 1 ? "near" : "far";
    text += printed(
        "<tr><td>%s</td><td class=\"word\">%s</td><td>%s</td><td>%s</td><td>%s</td>"
        "<td>%.2f</td><td>%.0f %%</td><td class=\"word\"><span class=\"chip %s\">%s"
        "</span></td></tr>\n",
        escaped(d.after.kernel).c_str(), escaped(variant_text(*pair.after, d.after)).c_str(),
        grouped(d.after.particles).c_str(), three_digits(d.before.best_ms()).c_str(),
        three_digits(d.after.best_ms()).c_str(), d.ratio(), 100 * d.noise(), kind, verdict_on(d));
  }
  return text + "</table></div>\n<p>" + escaped(change_summary(differences)) + ".</p>\n";
}

std::string session_section(const BenchRun& run, const Session& session,
                            const std::vector<Verdict>& verdicts) {
  std::string text;
  const auto judged = std::find_if(verdicts.begin(), verdicts.end(),
                                   [&](const Verdict& v) { return v.session == &session; });
  std::vector<std::string> near;
  for (const Verdict& v : verdicts)
    if (v.session->device == session.device && v.near_limit()) near.push_back(v.result->kernel);
  const std::string plot = "<p>" + escaped(roofline_line(session.roofline)) + ".</p>\n" +
                           "<div class=\"panel\">" + roofline_plot(session, near) + "</div>\n" +
                           results_rows(session);
  if (judged == verdicts.end())
    return "<details><summary>" + escaped(title_of(session)) +
           ": roofline and all results</summary>\n" + plot + "</details>\n";
  text += "<h2>" + escaped(title_of(session)) + "</h2>\n<p>" + escaped(session.platform) +
          ", driver " + escaped(session.driver) + ". The bars are those of the largest frame, " +
          frame_of(*judged->result) + ", on all threads.</p>\n";
  for (const std::string& warning : warnings_on(session, one_thread_of(run, session)))
    text += "<p><strong>Warning: " + escaped(warning) + ".</strong></p>\n";
  text +=
      "<div class=\"legend\"><span><i style=\"background:var(--blue)\"></i>near the limit</span>"
      "<span><i style=\"background:var(--orange)\"></i>far from it</span>"
      "<span><b></b>near enough from here on</span></div>\n";
  text += verdict_bars(verdicts, session);
  text += "<h3>Roofline and all results</h3>\n" + plot;
  return text;
}

}  // namespace

std::string to_html(const BenchRun& run, const std::vector<SessionPair>& pairs) {
  const std::vector<Verdict> verdicts = farthest_first(judge(run));
  const auto count = [&](const std::string& word) {
    const auto number = std::count_if(verdicts.begin(), verdicts.end(),
                                      [&](const Verdict& v) { return v.word() == word; });
    return number > 0 ? std::to_string(number) : std::string("none");
  };
  std::string text = "<h1>How near each kernel is to what the device can do</h1>\n";
  text += printed(
      "<p>Meniscus %s. <strong>Far from the limit: %s of %s; open: %s.</strong> The "
      "farthest come first. A kernel is near when it reaches %.0f %% of the roofline that was "
      "measured in the same run, or %.1f of the speed of a native C++ version of the same "
      "algorithm on one thread and on all, as far as both were measured. It is open where it is "
      "far from the roofline and there is no native version to tell whether more is "
      "possible.</p>\n",
      escaped(run.version).c_str(), count("far").c_str(),
      counted(verdicts.size(), "kernel").c_str(), count("open").c_str(), 100 * kGoodShare,
      kGoodAgainstNative);
  for (const Session& session : run.sessions) text += session_section(run, session, verdicts);
  if (!pairs.empty()) text += "<h2>Comparison</h2>\n";
  for (const SessionPair& pair : pairs) text += comparison_rows(pair);
  text +=
      "<h2>How to read this</h2>\n<p>A time is that of the fastest launch, and its noise is how "
      "far the fastest quarter of the launches reaches above it. Times of kernels are from the "
      "device's events; rows marked <em>stage, wall time</em> are wall times of whole stages with "
      "the host's part, which have no share of the roofline. Bytes and operations are counted by "
      "hand from the algorithm, each array once; a kernel's share of the roofline is the largest "
      "of its shares of the bandwidth of a copy of as many bytes, of the arithmetic, of the atomic "
      "minima and of an empty kernel's speed. Where operations are not counted, there is no share. "
      "Small dots are smaller frames. A "
      "difference exceeds the noise when it is larger than both noises together, and than 2 "
      "%.</p>\n";
  return html_page("Meniscus: how fast its kernels are", kStyle, text);
}

}  // namespace meniscus::bench
