// The report as a page.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <set>

#include "base/comma_separated.hpp"
#include "base/printed.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "program/batch/contact_sheet.hpp"
#include "program/batch/frames.hpp"
#include "program/batch/report.hpp"
#include "program/batch/report_plots.hpp"
#include "program/batch/warnings.hpp"
#include "program/page/page.hpp"

namespace meniscus {
namespace {

constexpr std::size_t kMostTiles = 96, kMostFailures = 500;
constexpr std::size_t kPageSize = 2'900'000, kLeastForPictures = 600'000;  // bytes, about

constexpr char kStyle[] = R"css(
:root { --read: #2b9a8b; --write: #d09a1e; --quiet: #b9c2cc; }
@media (prefers-color-scheme: dark) { :root { --read: #3fae9f; --write: #d9ac45; --quiet: #4a5563; } }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(7.2rem, 1fr)); gap: .9rem 1.2rem; margin: .2rem 0 1.1rem; }
.figures b { display: block; font-size: 1.55rem; font-weight: 620; line-height: 1.25; letter-spacing: -.01em; font-variant-numeric: tabular-nums; }
.figures span { color: var(--soft); font-size: 13px; } .figures .bad b { color: var(--orange); }
.wide { max-width: none; } .note { border-left: 3px solid var(--write); padding: .1rem 0 .1rem .8rem; margin: .5rem 0; }
rect.done, path.extract, i.extract { fill: var(--blue); background: var(--blue); }
rect.warned, path.write, i.write { fill: var(--write); background: var(--write); }
rect.failed, i.failed { fill: var(--orange); background: var(--orange); }
rect.skipped, i.skipped { fill: var(--quiet); background: var(--quiet); }
rect.missing { fill: none; stroke: var(--orange); stroke-dasharray: 3 2; } i.missing { border: 1px dashed var(--orange); }
path.read, i.read { fill: var(--read); background: var(--read); }
i.warned { background: var(--write); }
.legend { margin: .1rem 0; } .legend i { border-radius: 2px; }
rect.failed.mark { opacity: .22; }
.curve { fill: none; stroke: var(--blue); stroke-width: 1.8; stroke-linejoin: round; stroke-linecap: round; } .point { fill: var(--blue); }
.over { fill: transparent; } .over:hover { fill: var(--ink); opacity: .08; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(26rem, 100%), 1fr)); gap: 0 1rem; }
.pair .panel { margin: .5rem 0; } .panel h3 { margin: 0 0 .5rem; } .panel h3 small { color: var(--soft); font-weight: 400; }
.sheet { display: grid; gap: .7rem .6rem; margin: .7rem 0; }
.sheet figure { margin: 0; } .sheet figcaption { font-size: 12px; color: var(--soft); font-variant-numeric: tabular-nums; padding-top: .1rem; }
.sheet img, .sheet .none { display: block; width: 100%; height: auto; border-radius: 4px; }
.sheet .none { background: var(--grid); color: var(--soft); padding: .5rem .6rem; font-size: 12px; line-height: 1.35; overflow: hidden; overflow-wrap: anywhere; }
.sheet .none b { display: block; color: var(--ink); font-weight: 600; } .sheet .failed { background: var(--orange-soft); } .sheet .failed, .sheet .failed b { color: var(--ink); }
.stages { display: grid; grid-template-columns: max-content 1fr repeat(3, max-content); gap: .3rem 1.4rem; align-items: center; font-size: 13px; font-variant-numeric: tabular-nums; }
.stages .head { color: var(--soft); } .stages .number { text-align: right; }
.stages .bar { height: 16px; background: var(--grid); border-radius: 3px; } .stages .bar i { display: block; height: 100%; border-radius: 3px; min-width: 1px; }
td.message { text-align: left; white-space: normal; overflow-wrap: anywhere; }
.chip { display: inline-block; font-size: 12.5px; padding: .05rem .6rem; border-radius: 3px; background: var(--grid); }
.chip.failed { background: var(--orange-soft); box-shadow: inset 3px 0 0 var(--orange); } .chip.warned { box-shadow: inset 3px 0 0 var(--write); }
.all td:nth-child(2), .all th:nth-child(2) { text-align: left; }
.all td:last-child { font-family: ui-monospace, "DejaVu Sans Mono", Menlo, monospace; font-size: 12px; }
)css";

std::string milliseconds(double ms) {
  return ms >= 1000 ? grouped(std::llround(ms)) : three_digits(ms);
}

// "2024-11-21 14:40 UTC".
std::string date(double seconds_since_1970) {
  constexpr double kYear10000 = 253402300800;
  if (!(std::abs(seconds_since_1970) < kYear10000)) return "an unknown time";
  const auto seconds = static_cast<std::time_t>(seconds_since_1970);
  std::tm parts{};
  char text[32];
  if (gmtime_r(&seconds, &parts) == nullptr ||
      std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &parts) == 0)
    return "an unknown time";
  return text;
}

std::optional<double> count_of(const FrameRecord& record, const char* name) {
  for (const auto& [key, value] : record.counts)
    if (key == name) return static_cast<double>(value);
  return std::nullopt;
}

// "fit", or "fit, ssm" where frames differ.
std::string all_of(const BatchReport& report, std::string FrameRecord::*entry) {
  std::set<std::string> words;
  for (const FrameHistory& f : report.frames)
    if (!(f.last.*entry).empty()) words.insert(f.last.*entry);
  return comma_separated(words);
}

// --- the head -----------------------------------------------------------------------------------

std::string headline(const BatchReport& report) {
  const std::size_t whole = report.count(FrameStatus::done) + report.count(FrameStatus::skipped);
  const std::size_t all = report.frames.size() + report.missing.size();
  if (all == 0) return "No frames";
  if (whole == all)
    return all == 1 ? "The frame is done" : "All " + grouped(all) + " frames are done";
  return grouped(whole) + " of " + counted(all, "frame") + (whole == 1 ? " is done" : " are done");
}

// "on node1", "on 3 devices of 2 hosts".
std::string places(const BatchReport& report) {
  std::set<std::string> hosts, devices;
  std::string device;
  for (const FrameHistory& f : report.frames) {
    if (!f.last.host.empty()) hosts.insert(f.last.host);
    if (!f.last.device.empty()) devices.insert(f.last.host + "\n" + (device = f.last.device));
  }
  if (hosts.empty() || devices.empty()) return "";
  const std::string what = devices.size() == 1 ? "<strong>" + escaped(device) + "</strong>"
                                               : counted(devices.size(), "device");
  return " on " + what + " of " +
         (hosts.size() == 1 ? "<strong>" + escaped(*hosts.begin()) + "</strong>"
                            : counted(hosts.size(), "host"));
}

std::string introduction(const BatchReport& report) {
  std::vector<std::int64_t> numbers = report.missing;
  double first = 0, last = 0;
  for (const FrameHistory& f : report.frames) {
    const FrameRecord& r = f.last;
    numbers.push_back(r.frame);
    if (!(r.start > 0)) continue;
    first = first > 0 ? std::min(first, r.start) : r.start;
    last = std::max(last, r.end);
  }
  const std::string by = all_of(report, &FrameRecord::version);
  std::string text = "Meniscus " + escaped(by.empty() ? version() : by);
  if (!numbers.empty()) text += ": frames <strong>" + frame_list(numbers) + "</strong>";
  const std::string method = all_of(report, &FrameRecord::method);
  if (!method.empty()) text += " by <strong>" + escaped(method) + "</strong>" + places(report);
  if (first > 0) text += ", begun " + date(first);
  const std::string begun = date(first), over = date(last);
  const bool same_day = begun.substr(0, 10) == over.substr(0, 10);
  if (last > first && over != begun) text += ", over " + (same_day ? over.substr(11) : over);
  return "<p class=\"wide\">" + text + ".</p>\n";
}

struct Figure {
  std::string number, what;
  bool bad = false;
};

std::string head(const BatchReport& report) {
  const std::size_t done = report.count(FrameStatus::done),
                    failed = report.count(FrameStatus::failed),
                    skipped = report.count(FrameStatus::skipped);
  std::uint64_t bytes = 0;
  std::size_t attempts = 0, once = 0, warned = 0;
  for (const FrameHistory& f : report.frames) {
    bytes += f.last.bytes;
    attempts += static_cast<std::size_t>(f.attempts);
    once += f.attempts > 0;
    warned += f.last.status == FrameStatus::done && !f.last.warnings.empty();
  }
  std::vector<Figure> figures{{grouped(done), "done"}};
  if (skipped > 0) figures.push_back({grouped(skipped), "there already"});
  figures.push_back({grouped(failed), "failed", failed > 0});
  figures.push_back({grouped(report.missing.size()), "missing", !report.missing.empty()});
  if (warned > 0) figures.push_back({grouped(warned), "with warnings"});
  if (attempts > once) figures.push_back({grouped(attempts - once), "further attempts"});
  if (report.seconds > 0) {
    figures.push_back(
        {three_digits(static_cast<double>(done) / report.seconds), "frames a second"});
    figures.push_back({duration(report.seconds), "at work"});
  }
  if (bytes > 0) figures.push_back({size_of(bytes), "written"});
  std::string text = "<div class=\"panel\"><div class=\"figures\">\n";
  for (const Figure& f : figures)
    text += std::string("<div") + (f.bad ? " class=\"bad\"" : "") + "><b>" + f.number +
            "</b><span>" + f.what + "</span></div>\n";
  text += "</div>\n" + status_strip(report) + "<div class=\"legend\">";
  const auto key = [&](bool shown, const char* kind, const char* what) {
    if (shown) text += std::string("<span><i class=\"") + kind + "\"></i>" + what + "</span>";
  };
  key(done > warned, "extract", "done");
  key(warned > 0, "warned", "done, with warnings");
  key(skipped > 0, "skipped", "there already");
  key(failed > 0, "failed", "failed");
  key(!report.missing.empty(), "missing", "missing");
  return text + "</div></div>\n";
}

// --- what went wrong ----------------------------------------------------------------------------

std::string row(const std::string& frames, const char* chip, const char* word,
                const std::string& message) {
  return "<tr><td>" + frames + "</td><td class=\"word\"><span class=\"chip " + chip + "\">" + word +
         "</span></td><td class=\"message\">" + escaped(message) + "</td></tr>\n";
}

std::string troubles(const BatchReport& report) {
  std::string rows;
  FrameWarnings failures;
  for (const FrameHistory& f : report.frames)
    if (f.last.status == FrameStatus::failed)
      failures.add(
          f.last.frame,
          f.last.error + (f.attempts > 1 ? " (" + std::to_string(f.attempts) + " attempts)" : ""));
  std::size_t told = 0, left_out = 0;
  for (const FrameWarning& failure : failures.kinds())
    if (told++ < kMostFailures)
      rows += row(frame_list(failure.frames), "failed", "failed", failure.message());
    else
      left_out += failure.frames.size();
  if (left_out > 0)
    rows += row("", "failed", "failed",
                "and " + counted(left_out, "frame") + " more: see the last table");
  if (!report.missing.empty())
    rows +=
        row(frame_list(report.missing), "failed", "missing", "not begun, or in none of the logs");

  FrameWarnings warnings;
  for (const FrameHistory& f : report.frames)
    for (const std::string& message : f.last.warnings) warnings.add(f.last.frame, message);
  for (const FrameWarning& w : warnings.kinds())
    rows += row(frame_list(w.frames), "warned", "warning", w.message());
  if (rows.empty()) return "";
  return "<h2>What went wrong</h2>\n<div class=\"panel\"><table><tr><th>frame</th>"
         "<th class=\"word\"></th><th class=\"word\">message</th></tr>\n" +
         rows + "</table></div>\n";
}

// --- plots --------------------------------------------------------------------------------------

std::string curves(const BatchReport& report) {
  struct Curve {
    const char* title;
    const char* unit;
    FrameValue value;
  };
  std::vector<Curve> all;
  for (const char* name : {"particles", "visible", "groups", "fits", "mesh triangles"})
    all.push_back({name, name, [name](const FrameRecord& r) { return count_of(r, name); }});
  all.push_back({"residual", "particle radii", [](const FrameRecord& r) { return r.residual; }});
  std::string text;
  for (const Curve& curve : all) {
    const std::string plot = curve_plot(report, curve.title, curve.unit, curve.value);
    if (plot.empty()) continue;
    const std::string unit = curve.unit == std::string(curve.title) ? "a frame" : curve.unit;
    text += "<div class=\"panel\"><h3>" + std::string(curve.title) + " <small>" + unit +
            "</small></h3>" + plot + "</div>\n";
  }
  return text.empty() ? "" : "<div class=\"pair\">\n" + text + "</div>\n";
}

std::string plots(const BatchReport& report) {
  double slowest = 0;
  for (const FrameHistory& f : report.frames)
    slowest = std::max(slowest, f.last.read_ms + f.last.extract_ms + f.last.write_ms);
  const double scale = slowest >= 2000 ? 1000 : 1;
  const char* const unit = slowest >= 2000 ? "s" : "ms";
  const auto time = [scale](double FrameRecord::*entry) {
    return [scale, entry](const FrameRecord& r) -> std::optional<double> {
      if (r.status == FrameStatus::done) return r.*entry / scale;
      return std::nullopt;
    };
  };
  const std::string times = stacked_plot(report, "Time of each frame", unit,
                                         {{"read", "read", time(&FrameRecord::read_ms)},
                                          {"extract", "extract", time(&FrameRecord::extract_ms)},
                                          {"write", "write", time(&FrameRecord::write_ms)}});
  const std::string rest = curves(report);
  if (times.empty() && rest.empty()) return "";
  std::string text = "<h2>Frame by frame</h2>\n";
  if (!times.empty())
    text +=
        std::string("<div class=\"panel\"><h3>time <small>") +
        (slowest >= 2000 ? "seconds" : "milliseconds") + " a frame</small></h3>" + times +
        "<div class=\"legend\"><span><i class=\"read\"></i>read</span><span><i class=\"extract\">"
        "</i>extract</span><span><i class=\"write\"></i>write</span></div></div>\n";
  return text + rest;
}

// --- shares -------------------------------------------------------------------------------------

std::string stage_shares(const BatchReport& report) {
  struct Row {
    std::string name;
    const char* kind;
    double sum = 0, most = 0;  // ms
  };
  std::vector<Row> rows{{"read", "read"}};
  Row write{"write", "write"}, rest{"extract", "extract"};
  std::map<std::string, std::size_t> row_of;  // of stages
  std::size_t frames = 0;
  const auto add = [](Row& row, double ms) {
    row.sum += ms;
    row.most = std::max(row.most, ms);
  };
  for (const FrameHistory& f : report.frames) {
    const FrameRecord& r = f.last;
    if (r.status != FrameStatus::done) continue;
    ++frames;
    add(rows[0], r.read_ms);
    add(write, r.write_ms);
    double other = r.extract_ms;
    for (const auto& [stage, ms] : r.stages) {
      const auto [row, is_new] = row_of.try_emplace(stage, rows.size());
      if (is_new) rows.push_back({stage, "extract"});
      add(rows[row->second], ms);
      other -= ms;
    }
    add(rest, std::max(0.0, other));
  }
  if (!row_of.empty()) rest.name = "the rest of extract";
  rows.push_back(rest);
  rows.push_back(write);
  double all = 0, largest = 0;
  for (const Row& row : rows) {
    all += row.sum;
    largest = std::max(largest, row.sum);
  }
  if (!(all > 0)) return "";
  std::string text =
      "<h2>Where the time goes</h2>\n<p>Host time over all frames. Where several are under way, "
      "waiting for each other is part of it.</p>\n<div class=\"panel\"><div "
      "class=\"stages\"><span class=\"head\">stage</span><span></span><span class=\"head "
      "number\">share</span>"
      "<span class=\"head number\">mean, ms</span><span class=\"head number\">most, ms</span>\n";
  for (const Row& row : rows)
    text += printed(
        "<span>%s</span><div class=\"bar\"><i class=\"%s\" style=\"width:%.1f%%\"></i></div>"
        "<span class=\"number\">%.1f %%</span><span class=\"number\">%s</span>"
        "<span class=\"number\">%s</span>\n",
        escaped(row.name).c_str(), row.kind, 100 * row.sum / largest, 100 * row.sum / all,
        milliseconds(row.sum / static_cast<double>(frames)).c_str(),
        milliseconds(row.most).c_str());
  return text + "</div></div>\n";
}

// Who did how much; nothing where one device did all.
std::string workers(const BatchReport& report) {
  struct Worker {
    std::size_t done = 0, failed = 0;
    double ms = 0;
  };
  std::map<std::array<std::string, 3>, Worker> all;
  std::size_t failed_before = 0;  // they had a device
  for (const FrameHistory& f : report.frames) {
    const FrameRecord& r = f.last;
    if (r.status == FrameStatus::skipped) continue;
    if (r.device.empty()) {
      ++failed_before;
      continue;
    }
    Worker& worker = all[{r.host, r.shard, r.device}];
    if (r.status == FrameStatus::done) {
      ++worker.done;
      worker.ms += r.extract_ms;
    } else {
      ++worker.failed;
    }
  }
  if (all.size() < 2) return "";
  std::string text = "<h2>Who did the work</h2>\n";
  if (failed_before > 0)
    text += "<p>Without " + counted(failed_before, "frame") + " that failed in reading.</p>\n";
  text +=
      "<div class=\"panel\"><table><tr><th>host</th><th class=\"word\">shard</th>"
      "<th class=\"word\">device</th><th>done</th><th>failed</th><th>extract, mean ms</th></tr>\n";
  for (const auto& [who, worker] : all)
    text += "<tr><td>" + escaped(who[0]) + "</td><td class=\"word\">" + escaped(who[1]) +
            "</td><td class=\"word\">" + escaped(who[2]) + "</td><td>" + grouped(worker.done) +
            "</td><td>" + grouped(worker.failed) + "</td><td>" +
            (worker.done > 0 ? milliseconds(worker.ms / static_cast<double>(worker.done)) : "") +
            "</td></tr>\n";
  return text + "</table></div>\n";
}

// --- all frames ---------------------------------------------------------------------------------

std::string all_frames(const BatchReport& report) {
  std::vector<const char*> names;  // of the counts that some frame has
  for (const char* name :
       {"particles", "visible", "groups", "fits", "triangles", "pixels", "mesh triangles"})
    if (std::any_of(report.frames.begin(), report.frames.end(),
                    [&](const FrameHistory& f) { return count_of(f.last, name).has_value(); }))
      names.push_back(name);
  std::string text =
      "<h2>All frames</h2>\n<details><summary>Times, counts and hashes of " +
      counted(report.frames.size(), "frame") +
      "</summary>\n<div class=\"panel\"><table class=\"all\"><tr><th>frame</th><th>status</th>"
      "<th>attempts</th><th>read, ms</th><th>extract, ms</th><th>write, ms</th>";
  for (const char* name : names) text += std::string("<th>") + name + "</th>";
  text += "<th>residual</th><th>size</th><th>hash</th></tr>\n";
  for (const FrameHistory& f : report.frames) {
    const FrameRecord& r = f.last;
    const auto cell = [&](bool known, const std::string& value) {
      text += "<td>" + (known ? value : "") + "</td>";
    };
    const bool done = r.status == FrameStatus::done;
    text += "<tr><td>" + std::to_string(r.frame) + "</td><td>" + to_string(r.status) + "</td>";
    cell(f.attempts > 0, std::to_string(f.attempts));
    for (const double ms : {r.read_ms, r.extract_ms, r.write_ms}) cell(done, milliseconds(ms));
    for (const char* name : names) {
      const auto value = count_of(r, name);
      cell(value.has_value(), grouped(std::llround(value.value_or(0))));
    }
    cell(r.residual.has_value(), three_digits(r.residual.value_or(0)));
    cell(r.bytes > 0, size_of(r.bytes));
    text += "<td>" + escaped(r.hash) + "</td></tr>\n";
  }
  return text + "</table></div></details>\n";
}

// --- pictures -----------------------------------------------------------------------------------

// The pictures' files as text, at the largest width at which they have room.
std::vector<std::string> encoded(const std::vector<Tile>& tiles, std::size_t room) {
  std::vector<std::string> pictures;
  for (const int width : {320, 256, 208, 168, 136, 112, 88}) {
    pictures.clear();
    std::size_t size = 0;
    for (const Tile& tile : tiles) {
      pictures.push_back(tile.picture ? base64(encode_png(shrunk(*tile.picture, width))) : "");
      size += pictures.back().size();
    }
    if (size <= room) break;
  }
  return pictures;
}

std::string sheet(const BatchReport& report, std::size_t room) {
  const std::vector<Tile> tiles = contact_sheet(report, kMostTiles, 320);
  if (tiles.empty()) return "";
  if (std::none_of(tiles.begin(), tiles.end(),
                   [](const Tile& t) { return t.picture.has_value(); })) {
    for (const Tile& tile : tiles)
      if (tile.why_none != "failed" && tile.why_none != "missing")
        return "<h2>Frames</h2>\n<p>There are no pictures: of frame " + std::to_string(tile.frame) +
               ", " + escaped(tile.details) + ".</p>\n";
    return "";
  }
  const std::vector<std::string> pictures = encoded(tiles, room);
  const std::size_t all = report.frames.size() + report.missing.size();
  std::string shape = "4 / 3";  // of tiles without a picture
  for (const Tile& tile : tiles)
    if (tile.picture) {
      shape = printed("%d / %d", tile.picture->width, tile.picture->height);
      break;
    }
  std::string text = "<h2>Frames</h2>\n";
  if (tiles.size() < all)
    text += "<p>" + grouped(tiles.size()) + " of " + counted(all, "frame") + ".</p>\n";
  text += printed(
      "<div class=\"sheet\" style=\"grid-template-columns:repeat(auto-fill,minmax(%d"
      "px,1fr))\">\n",
      tiles.size() <= 4    ? 240
      : tiles.size() <= 24 ? 170
                           : 125);
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    const Tile& tile = tiles[k];
    const std::string name = "frame " + std::to_string(tile.frame);
    text += "<figure>";
    if (tile.picture)
      text += "<img alt=\"" + name + "\" src=\"data:image/png;base64," + pictures[k] + "\">";
    else
      text += "<div class=\"none" + std::string(tile.why_none == "failed" ? " failed" : "") +
              "\" style=\"aspect-ratio:" + shape + "\" title=\"" + escaped(tile.details) +
              "\"><b>" + tile.why_none + "</b>" + escaped(tile.details) + "</div>";
    text += "<figcaption>" + name + "</figcaption></figure>\n";
  }
  return text + "</div>\n";
}

}  // namespace

std::string to_html(const BatchReport& report) {
  std::string top = "<h1>" + headline(report) + "</h1>\n" + introduction(report);
  for (const std::string& note : report.notes)
    top += "<p class=\"wide note\">" + escaped(note) + "</p>\n";
  top += head(report) + troubles(report);
  const std::string bottom =
      plots(report) + stage_shares(report) + workers(report) + all_frames(report);
  const std::size_t text = top.size() + bottom.size();
  const std::size_t room =
      text + kLeastForPictures < kPageSize ? kPageSize - text : kLeastForPictures;
  return html_page("Meniscus: " + headline(report), kStyle, top + sheet(report, room) + bottom);
}

}  // namespace meniscus
