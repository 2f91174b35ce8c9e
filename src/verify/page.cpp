#include "verify/page.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "page/page.hpp"
#include "printed.hpp"

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
th.device { max-width: 11rem; white-space: normal; text-align: center; }
th.sub { text-align: center; font-size: 11.5px; white-space: normal; }
.hash { font-family: ui-monospace, Menlo, monospace; font-size: 12px; }
)css";

std::string attribute(const std::string& text) { return " title=\"" + escaped(text) + "\""; }

// All rows of one cell: their worst result, and why.
struct Cell {
  Tally tally;
  double ulp = -1;
  std::string why;

  void add(const Row& row) {
    tally.add(row.result);
    if (row.result != Result::pass && why.empty()) why = row.size + ": " + row.reason;
    if (row.result == Result::fail) ulp = std::max(ulp, row.ulp);
  }
  std::string html() const {
    const auto& [passed, failed, skipped] = tally;
    if (tally.all() == 0) return "<td></td>";
    if (failed > 0) {
      Row worst;
      worst.result = Result::fail;
      worst.ulp = ulp;
      const std::string error = ulp > 0 ? error_of(worst) : "differs";
      return "<td class=\"fail\"" + attribute(why) + ">" + escaped(error) + "</td>";
    }
    if (passed == 0) return "<td class=\"skip\"" + attribute(why) + ">skipped</td>";
    return std::string("<td class=\"pass\"") +
           attribute(std::to_string(passed) + " cases, the same bits" +
                     (skipped ? ", " + std::to_string(skipped) + " skipped" : "")) +
           ">" + (skipped ? "&#10003;*" : "&#10003;") + "</td>";
  }
};

std::string card_of(const DeviceResults& device) {
  std::string text = std::string("<div class=\"card ") +
                     (device.unusable() ? "none"
                      : device.good()   ? ""
                                        : "bad") +
                     "\"><span class=\"verdict\">" + device.verdict();
  text += "</span><b>" + escaped(device.device.name) + "</b><small>" +
          escaped(device.device.platform + ", driver " + device.device.driver) + "</small><small>" +
          escaped(device.device.version) + ", " + duration(device.seconds) + "</small><ul>";
  for (const auto& [group, tally] : device.tallies())
    text += "<li>" + group + "s: " + tally.words() + "</li>";
  return text + "</ul></div>\n";
}

std::string failures_of(const VerifyRun& run) {
  std::string text;
  for (const DeviceResults& device : run.devices)
    for (const auto& [row, cases] : device.failures())
      text += "<tr><td class=\"word\">" + escaped(device.device.name) + "</td><td class=\"word\">" +
              row->group + "</td><td class=\"word\">" + escaped(row->kernel) +
              "</td><td class=\"word\">" + escaped(row->variant) + "</td><td class=\"word\">" +
              std::to_string(cases) + "</td><td>" + error_of(*row) + "</td><td class=\"reason\">" +
              escaped(row->size + (row->size.empty() ? "" : ": ") + row->reason +
                      (row->section.empty() ? "" : " [" + row->section + "]")) +
              (row->required ? "" : " <small>(not required)</small>") + "</td></tr>\n";
  if (text.empty()) return "";
  return "<h2>What failed</h2><div class=\"panel\"><table><tr><th class=\"word\">device</th><th "
         "class=\"word\">what</th><th class=\"word\">kernel</th><th class=\"word\">variant</th><th "
         "class=\"word\">cases</th><th>error</th><th class=\"word\">the first</th></tr>\n" +
         text + "</table></div>\n";
}

std::string device_heads(const VerifyRun& run, std::size_t columns) {
  std::string text;
  for (const DeviceResults& device : run.devices)
    text += "<th class=\"device\" colspan=\"" + std::to_string(columns) + "\">" +
            escaped(device.device.name) + "<br><small>" + escaped(device.device.platform) +
            "</small></th>";
  return text;
}

// A table of one group of rows: a line for each kernel in the order of the first device, columns
// for devices and variants.
std::string matrix_of(const VerifyRun& run, const std::string& group) {
  std::vector<std::string> kernels, variants;
  const auto note = [](std::vector<std::string>& list, const std::string& name) {
    if (std::find(list.begin(), list.end(), name) == list.end()) list.push_back(name);
  };
  std::map<std::string, Cell> cells;
  const auto key = [](std::size_t device, const std::string& variant, const std::string& kernel) {
    return std::to_string(device) + "\n" + variant + "\n" + kernel;
  };
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != group) continue;
      note(kernels, row.kernel);
      note(variants, row.variant);
      cells[key(d, row.variant, row.kernel)].add(row);
    }
  if (kernels.empty()) return "";
  std::string text =
      "<div class=\"panel\"><table><tr><th></th>" + device_heads(run, variants.size()) + "</tr>\n";
  if (variants.size() > 1 || !variants.front().empty()) {
    text +=
        "<tr><th class=\"word\">" + std::string(group == "frame" ? "method" : "kernel") + "</th>";
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      for (const std::string& variant : variants)
        text += "<th class=\"sub\">" + escaped(variant) + "</th>";
    text += "</tr>\n";
  }
  for (const std::string& kernel : kernels) {
    text += "<tr><td class=\"word\">" + escaped(kernel) + "</td>";
    for (std::size_t d = 0; d < run.devices.size(); ++d)
      for (const std::string& variant : variants) text += cells[key(d, variant, kernel)].html();
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

// Whole frames: their hashes, so that everyone can see that they are the same.
std::string frames_of(const VerifyRun& run) {
  std::vector<std::pair<std::string, std::string>> lines;  // frame, method
  std::map<std::string, const Row*> cells;
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != "frame") continue;
      if (std::find(lines.begin(), lines.end(), std::pair(row.size, row.kernel)) == lines.end())
        lines.emplace_back(row.size, row.kernel);
      cells[std::to_string(d) + "\n" + row.size + "\n" + row.kernel] = &row;
    }
  if (lines.empty()) return "";
  std::string text =
      "<h2>Whole frames</h2><p>The hash of maps and mesh. It is the same on every "
      "device and with every vector width.</p><div class=\"panel\"><table><tr><th "
      "class=\"word\">frame</th><th class=\"word\">method</th>" +
      device_heads(run, 1) + "</tr>\n";
  for (const auto& [frame, method] : lines) {
    text += "<tr><td class=\"word\">" + escaped(frame) + "</td><td class=\"word\">" +
            escaped(method) + "</td>";
    for (std::size_t d = 0; d < run.devices.size(); ++d) {
      const auto found = cells.find(std::to_string(d) + "\n" + frame + "\n" + method);
      if (found == cells.end()) {
        text += "<td></td>";
        continue;
      }
      const Row& row = *found->second;
      const bool hash = row.reason.starts_with("hash ");
      text += std::string("<td class=\"") + to_string(row.result) + " hash\"" +
              attribute(row.reason + ", " + three_digits(row.ms) + " ms") + ">" +
              escaped(hash ? row.reason.substr(5, 16) : std::string(to_string(row.result))) +
              "</td>";
    }
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

// Figures of every device side by side: limits, or what probes have to say.
std::string figures_of(const VerifyRun& run, const std::string& group, const std::string& title,
                       const std::string& what) {
  std::vector<std::pair<std::string, std::string>> lines;  // name, section
  std::map<std::string, const Row*> cells;
  for (std::size_t d = 0; d < run.devices.size(); ++d)
    for (const Row& row : run.devices[d].rows) {
      if (row.group != group) continue;
      const std::string name = row.kernel + (row.variant.empty() ? "" : ", " + row.variant);
      if (std::find_if(lines.begin(), lines.end(),
                       [&](const auto& line) { return line.first == name; }) == lines.end())
        lines.emplace_back(name, row.section);
      cells[std::to_string(d) + "\n" + name] = &row;
    }
  if (lines.empty()) return "";
  std::string text = "<h2>" + title + "</h2><p>" + what +
                     "</p><div class=\"panel\"><table><tr><th></th>" + device_heads(run, 1) +
                     "<th class=\"word\">rests on</th></tr>\n";
  for (const auto& [name, section] : lines) {
    text += "<tr><td class=\"word\">" + escaped(name) + "</td>";
    for (std::size_t d = 0; d < run.devices.size(); ++d) {
      const auto found = cells.find(std::to_string(d) + "\n" + name);
      if (found == cells.end()) {
        text += "<td></td>";
        continue;
      }
      const Row& row = *found->second;
      std::string words = row.result == Result::pass   ? row.reason
                          : row.result == Result::fail ? (row.ulp > 0 ? error_of(row) : "differs")
                                                       : "skipped";
      if (words.empty()) words = row.ulp > 0 ? error_of(row) : "as it should";
      const bool some = row.result == Result::fail && !row.required;
      text += std::string("<td class=\"") + (some ? "some" : to_string(row.result)) + "\"" +
              attribute(row.reason) + ">" + escaped(words) + "</td>";
    }
    text += "<td class=\"word\"><small>" + escaped(section) + "</small></td></tr>\n";
  }
  return text + "</table></div>\n";
}

}  // namespace

std::string to_html(const VerifyRun& run) {
  std::string body =
      "<h1>Does it compute what it should?</h1><p>Meniscus " + escaped(run.version) +
      " ran its kernels on " + std::to_string(run.devices.size()) +
      (run.devices.size() == 1 ? " device" : " devices") +
      ". Every launch must leave the <strong>canonical bits</strong> in its buffers, "
      "in every variant.</p>\n<div class=\"cards\">\n";
  for (const DeviceResults& device : run.devices) body += card_of(device);
  body += "</div>\n" + failures_of(run);
  body += frames_of(run);
  if (const std::string kernels = matrix_of(run, "kernel"); !kernels.empty())
    body +=
        "<h2>Kernels</h2><p>A tick: the same bits in all cases. A number: how far the worst "
        "value was off, in units in the last place. A star: some cases could not be judged. "
        "Point at a cell to see more.</p>" +
        kernels;
  if (const std::string references = matrix_of(run, "reference"); !references.empty())
    body +=
        "<h2>Against double precision</h2><p>Whether the results are near what the equations "
        "say, computed in double precision on the host.</p>" +
        references;
  body += figures_of(run, "probe", "Arithmetic",
                     "What the same bits rest on. Orange: differs, but nothing rests on it.");
  body += figures_of(run, "limit", "Limits", "Probed, not believed.");
  return html_page("meniscus verify", kStyle, body);
}

}  // namespace meniscus::verify
