#include "verify/page.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "base/printed.hpp"
#include "program/page/page.hpp"

namespace meniscus::verify {
namespace {

constexpr char kStyle[] = R"css(
:root { --good: #2f7d4f; --good-soft: #d5ecdd; --bad: #b3261e; --bad-soft: #f8d7d4; --skip-soft: #e9ecf0; }
@media (prefers-color-scheme: dark) { :root { --good: #6cc48f; --good-soft: #1e4430; --bad: #ff8a80;
  --bad-soft: #5a2320; --skip-soft: #2b323b; } }
.cards { display: flex; flex-wrap: wrap; gap: 1rem; margin: 1rem 0 .4rem; }
.card { background: var(--panel); border: 1px solid var(--line); border-left: .45rem solid var(--good);
  border-radius: 8px; padding: .7rem 1.1rem; flex: 1 1 19rem; }
.card.bad { border-left-color: var(--bad); } .card.none { border-left-color: var(--soft); }
.card b { font-size: 1.05rem; } .card .verdict { float: right; font-weight: 650; color: var(--good); }
.card.bad .verdict { color: var(--bad); } .card.none .verdict { color: var(--soft); }
.card small { color: var(--soft); display: block; } .card ul { margin: .4rem 0 0; padding: 0; list-style: none; font-size: 13px; }
td.pass, td.fail, td.skip, td.some { text-align: center; border: 1px solid var(--ground); }
td.pass { background: var(--good-soft); } td.fail { background: var(--bad-soft); color: var(--bad); font-weight: 600; }
td.some { background: var(--orange-soft); } td.skip { background: var(--skip-soft); color: var(--soft); }
td.reason { white-space: normal; text-align: left; min-width: 24rem; }
td.words { white-space: normal; min-width: 9rem; }
td.section { white-space: normal; text-align: left; min-width: 11rem; }
th.device { max-width: 11rem; white-space: normal; text-align: center; }
th.sub { text-align: center; font-size: 11.5px; white-space: normal; }
.hash { font-family: ui-monospace, Menlo, monospace; font-size: 12px; }
)css";

// Files that are compared may name any number of kernels and variants; a page has room for what
// people and browsers can take.
constexpr std::size_t kMostCells = 200'000;  // of one table

// How many of a table's lines are shown, and what is said of the others.
struct Lines {
  std::size_t shown;
  std::string rest;  // behind the table

  Lines(std::size_t count, std::size_t columns)
      : shown(std::min(count, kMostCells / std::max<std::size_t>(1, columns))) {
    if (shown < count)
      rest = "<p>" + counted(count - shown, "more line") + ": too many for one page.</p>\n";
  }
};

// Things in the order in which they come, each once.
template <class Thing>
class InOrder {
 public:
  void add(const Thing& thing) {
    if (known_.insert(thing).second) things_.push_back(thing);
  }
  const std::vector<Thing>& things() const { return things_; }

 private:
  std::set<Thing> known_;
  std::vector<Thing> things_;
};

std::string attribute(const std::string& text) { return " title=\"" + escaped(text) + "\""; }

// A cell of words, as HTML.
std::string word(const std::string& html, const std::string& attributes = "") {
  return "<td class=\"word\"" + attributes + ">" + html + "</td>";
}

std::string word_heads(std::initializer_list<const char*> words) {
  std::string text;
  for (const char* one : words) text += std::string("<th class=\"word\">") + one + "</th>";
  return text;
}

std::string table(const std::string& lines) {
  return "<div class=\"panel\"><table>" + lines + "</table></div>\n";
}

// The cell of a place, as `html` has it; an empty one where there is none.
template <class Cells, class Html>
std::string cell_at(const Cells& cells, const typename Cells::key_type& place, const Html& html) {
  const auto found = cells.find(place);
  return found == cells.end() ? "<td></td>" : html(found->second);
}

// All rows of one cell: their worst result, and why.
struct Cell {
  Tally tally;
  double ulp = -1;
  bool required = false;  // one that failed must pass
  std::string why;

  void add(const Row& row) {
    tally.add(row.result);
    if (row.result != Result::pass && why.empty()) why = row.size + ": " + row.reason;
    if (row.result != Result::fail) return;
    ulp = std::max(ulp, row.ulp);
    required = required || row.required;
  }
  std::string html() const {
    const auto& [passed, failed, skipped] = tally;
    if (failed > 0) {
      Row worst;
      worst.result = Result::fail;
      worst.ulp = ulp;
      const std::string error = ulp > 0 ? error_of(worst) : "differs";
      return std::string("<td class=\"") + (required ? "fail" : "some") + "\"" + attribute(why) +
             ">" + escaped(error) + "</td>";
    }
    if (passed == 0) return "<td class=\"skip\"" + attribute(why) + ">skipped</td>";
    return std::string("<td class=\"pass\"") +
           attribute(std::to_string(passed) + " cases, the same bits" +
                     (skipped ? ", " + std::to_string(skipped) + " skipped" : "")) +
           ">" + (skipped ? "&#10003;*" : "&#10003;") + "</td>";
  }
};

// A device in a table: two drivers may give theirs the same name, and two runs have the same
// device.
std::string name_of(const DeviceResults& results) {
  const DeviceName& device = results.device;
  return escaped(device.name) + "<br><small>" + escaped(device.platform) +
         (device.driver.empty() ? "" : ", driver " + escaped(device.driver)) +
         number_words(results) + (results.file.empty() ? "" : ", " + escaped(results.file)) +
         "</small>";
}

std::string cell_of(const Row& row) {
  // The reason of a reference that passes names its error.
  const bool names_error = row.group == "reference" && row.result == Result::pass;
  const std::string error = row.ulp > 0 && !names_error ? error_of(row) : "";
  std::string words;
  if (row.result == Result::skip)
    words = "skipped";
  else if (row.result == Result::fail)
    words = error.empty() ? "differs" : error;
  else
    words = row.reason + (row.reason.empty() || error.empty() ? "" : ", ") + error;
  if (words.empty()) words = "pass";
  const bool some = row.result == Result::fail && !row.required;
  return std::string("<td class=\"") + (some ? "some" : to_string(row.result)) + " words\"" +
         attribute(row.reason) + ">" + escaped(words) + "</td>";
}

std::string card_of(const DeviceResults& device) {
  std::string text = std::string("<div class=\"card ") +
                     (device.unusable() ? "none"
                      : device.good()   ? ""
                                        : "bad") +
                     "\"><span class=\"verdict\">" + device.verdict();
  text += "</span><b>" + escaped(device.device.name) + "</b><small>" +
          escaped(device.device.platform + ", driver " + device.device.driver) +
          number_words(device) + (device.file.empty() ? "" : ", " + escaped(device.file)) +
          "</small><small>" + escaped(device.device.version) + ", " + duration(device.seconds) +
          "</small><ul>";
  for (const auto& [group, tally] : device.tallies())
    text += "<li>" + group + "s: " + tally.words() + "</li>";
  if (!device.unfinished.empty())
    text += "<li><strong>Unfinished:</strong> " + escaped(device.unfinished) + "</li>";
  return text + "</ul></div>\n";
}

std::string failures_of(const VerifyRun& run) {
  std::string text;
  for (const DeviceResults& device : run.devices) {
    std::vector<Failure> failures = device.failures();
    std::stable_partition(failures.begin(), failures.end(),
                          [](const Failure& failure) { return failure.first->required; });
    for (const auto& [row, cases] : failures)
      text += "<tr>" + word(name_of(device)) + word(escaped(row->group)) +
              word(escaped(row->kernel)) + word(escaped(row->variant)) +
              word(std::to_string(cases)) + "<td>" + error_of(*row) + "</td><td class=\"reason\">" +
              escaped(row->size + (row->size.empty() ? "" : ": ") + row->reason +
                      (row->section.empty() ? "" : " [" + row->section + "]")) +
              (row->required ? "" : " <small>(not required)</small>") + "</td></tr>\n";
  }
  if (text.empty()) return "";
  std::string advice;
  for (const std::string& line : advice_of(run)) advice += "<p>" + escaped(line) + "</p>\n";
  return "<h2>What failed</h2>" + advice +
         table("<tr>" + word_heads({"device", "what", "kernel", "variant", "cases"}) +
               "<th>error</th>" + word_heads({"the first"}) + "</tr>\n" + text);
}

std::string device_heads(const VerifyRun& run, std::size_t columns) {
  std::string text;
  for (const DeviceResults& device : run.devices)
    text += "<th class=\"device\" colspan=\"" + std::to_string(columns) + "\">" + name_of(device) +
            "</th>";
  return text;
}

// What the first device finds otherwise than another: a line for each kernel and variant, with the
// first of its cases.
std::string differences_of(const VerifyRun& run) {
  if (run.devices.size() < 2) return "";
  const DeviceResults& first = run.devices.front();
  const auto kind = [](const Row& row) {
    return std::tuple(row.group, row.kernel, compared_variant(row));
  };
  std::map<decltype(kind(Row{})), std::set<std::string>> sizes;
  const auto place = [&](const Row& row) { return std::pair(kind(row), row.size); };
  std::vector<std::map<decltype(place(Row{})), const Row*>> rows;  // of each device
  for (const DeviceResults& device : run.devices) {
    auto& known = rows.emplace_back();
    for (const Row& row : device.rows) known.try_emplace(place(row), &row);
  }
  std::vector<const Row*> lines;  // of the first device
  std::string counts;
  for (std::size_t d = 1; d < run.devices.size(); ++d) {
    const Comparison comparison = compared(first, run.devices[d]);
    for (const auto& [before, after] : comparison.changes) {
      if (!before || !after) continue;  // the runs had other cases
      std::set<std::string>& cases = sizes[kind(*before)];
      if (cases.empty()) lines.push_back(before);
      cases.insert(before->size);
    }
    counts += (counts.empty() ? "" : "; ") + escaped(title_of(run.devices[d])) + ": " +
              grouped(comparison.same) + " rows the same, <strong>" +
              grouped(comparison.differing()) + " other</strong>";
    if (comparison.only_before > 0)
      counts += ", " + grouped(comparison.only_before) + " only in the first";
    if (comparison.only_after > 0)
      counts += ", " + grouped(comparison.only_after) + " only in this one";
  }
  const std::string title = "<h2>What differs</h2><p>Compared with " + escaped(title_of(first)) +
                            ". " + counts + ".</p>\n";
  if (lines.empty()) return title;
  std::string text = "<tr>" + word_heads({"what", "kernel", "variant", "cases"}) +
                     device_heads(run, 1) + "</tr>\n";
  const Lines room(lines.size(), run.devices.size());
  for (const Row* line : std::span(lines).first(room.shown)) {
    text += "<tr>" + word(escaped(line->group)) + word(escaped(line->kernel)) +
            word(escaped(compared_variant(*line))) +
            word(std::to_string(sizes[kind(*line)].size()), attribute(line->size));
    for (const auto& known : rows)
      text += cell_at(known, place(*line), [](const Row* row) { return cell_of(*row); });
    text += "</tr>\n";
  }
  return title + table(text) + room.rest;
}

// A table of one group of rows: a line for each kernel in the order of the first device, columns
// for devices and variants.
std::string matrix_of(const VerifyRun& run, const std::string& group) {
  InOrder<std::string> all_kernels, all_variants;
  std::map<std::tuple<std::size_t, std::string, std::string>, Cell> cells;
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != group) continue;
      all_kernels.add(row.kernel);
      all_variants.add(row.variant);
      cells[{d, row.variant, row.kernel}].add(row);
    }
  const std::vector<std::string>&kernels = all_kernels.things(), &variants = all_variants.things();
  if (kernels.empty()) return "";
  const Lines room(kernels.size(), run.devices.size() * variants.size());
  if (room.shown == 0) return room.rest;
  std::string text = "<tr><th></th>" + device_heads(run, variants.size()) + "</tr>\n";
  if (variants.size() > 1 || !variants.front().empty()) {
    text += "<tr>" + word_heads({group == "frame" ? "method" : "kernel"});
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      for (const std::string& variant : variants)
        text += "<th class=\"sub\">" + escaped(variant) + "</th>";
    text += "</tr>\n";
  }
  for (const std::string& kernel : std::span(kernels).first(room.shown)) {
    text += "<tr>" + word(escaped(kernel));
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      for (const std::string& variant : variants)
        text += cell_at(cells, {d, variant, kernel}, [](const Cell& cell) { return cell.html(); });
    text += "</tr>\n";
  }
  return table(text) + room.rest;
}

// Whole frames: their hashes, so that everyone can see that they are the same.
std::string frames_of(const VerifyRun& run) {
  InOrder<std::pair<std::string, std::string>> all;  // frame, method
  std::map<std::tuple<std::size_t, std::string, std::string>, const Row*> cells;
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != "frame") continue;
      const std::string variant = compared_variant(row);
      const std::string method = row.kernel + (variant.empty() ? "" : ", " + variant);
      all.add({row.size, method});
      cells[{d, row.size, method}] = &row;
    }
  const auto& lines = all.things();
  if (lines.empty()) return "";
  const Lines room(lines.size(), run.devices.size());
  std::string text = "<tr>" + word_heads({"frame", "method"}) + device_heads(run, 1) + "</tr>\n";
  for (const auto& [frame, method] : std::span(lines).first(room.shown)) {
    text += "<tr>" + word(escaped(frame)) + word(escaped(method));
    const Row* first = nullptr;
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      text += cell_at(cells, {d, frame, method}, [&](const Row* row) {
        if (!first) first = row;
        const bool hash = row->reason.starts_with("hash ");
        const bool other = row->result == Result::pass && first->result == Result::pass &&
                           row->reason != first->reason;
        return std::string("<td class=\"") + (other ? "some" : to_string(row->result)) + " hash\"" +
               attribute(row->reason + ", " + three_digits(row->ms) + " ms") + ">" +
               escaped(hash ? row->reason.substr(5, 16) : std::string(to_string(row->result))) +
               "</td>";
      });
    text += "</tr>\n";
  }
  return "<h2>Whole frames</h2><p>The hash of maps and mesh. It is the same on every "
         "device and with every vector width. Orange: right for the version of Meniscus "
         "that ran there, but another hash than in the first column: the two runs used different "
         "versions.</p>" +
         table(text) + room.rest;
}

// Figures of every device side by side: limits, or what probes have to say.
std::string figures_of(const VerifyRun& run, const std::string& group, const std::string& title,
                       const std::string& what) {
  std::map<std::string, std::string> sections;  // by name
  InOrder<std::string> names;
  std::map<std::pair<std::size_t, std::string>, const Row*> cells;
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != group) continue;
      const std::string name = row.kernel + (row.variant.empty() ? "" : ", " + row.variant);
      names.add(name);
      sections.try_emplace(name, row.section);
      cells[{d, name}] = &row;
    }
  if (names.things().empty()) return "";
  const Lines room(names.things().size(), run.devices.size());
  std::string text = "<tr><th></th>" + device_heads(run, 1) +
                     word_heads({"section of the specification"}) + "</tr>\n";
  for (const std::string& name : std::span(names.things()).first(room.shown)) {
    text += "<tr>" + word(escaped(name));
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      text += cell_at(cells, {d, name}, [](const Row* row) { return cell_of(*row); });
    text += "<td class=\"section\"><small>" + escaped(sections.at(name)) + "</small></td></tr>\n";
  }
  return "<h2>" + title + "</h2><p>" + what + "</p>" + table(text) + room.rest;
}

}  // namespace

std::string to_html(const VerifyRun& run) {
  const std::string devices = counted(run.devices.size(), "device");
  const bool of_others =
      std::any_of(run.devices.begin(), run.devices.end(), [](const auto& device) {
        return !device.rows.empty() && device.rows.back().group == "program";
      });
  std::string body = "<h1>Does it compute what it should?</h1><p>Meniscus " + escaped(run.version) +
                     (of_others ? " ran a kernel that is not its own on " + devices +
                                      ". All runs must leave the same bits in its buffers, "
                                      "everywhere.</p>\n"
                                : " ran its kernels on " + devices +
                                      ". Every launch must leave the <strong>canonical "
                                      "bits</strong> in its buffers, in every variant.</p>\n") +
                     "<div class=\"cards\">\n";
  for (const DeviceResults& device : run.devices) body += card_of(device);
  body += "</div>\n" + failures_of(run);
  body += differences_of(run);
  body += frames_of(run);
  if (const std::string kernels = matrix_of(run, "kernel"); !kernels.empty())
    body +=
        "<h2>Kernels</h2><p>A tick: the same bits in all cases. A number: how far the worst "
        "value was off, in units in the last place. A star: some cases could not be judged. "
        "Orange: not required, as another vector width than the one that the device is used with. "
        "Point at a cell to see more.</p>" +
        kernels;
  if (const std::string references = matrix_of(run, "reference"); !references.empty())
    body +=
        "<h2>Against double precision</h2><p>Whether the results are near what the equations "
        "say, computed in double precision on the host.</p>" +
        references;
  body +=
      figures_of(run, "program", "Runs",
                 "Whether runs leave the same bits, those that are expected, and the same as on "
                 "the first device.");
  body += figures_of(run, "flaw", "Known flaws of runtimes",
                     "Whether the device has them. Meniscus does not depend on them.");
  body += figures_of(run, "probe", "Arithmetic",
                     "What the same bits depend on. Orange: differs, but nothing depends on it.");
  body += figures_of(run, "limit", "Limits",
                     "Measured on the device; beside it what the driver states.");
  return html_page("meniscus verify", kStyle, body);
}

}  // namespace meniscus::verify
