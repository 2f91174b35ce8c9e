// The page: its style and script are part of it, and so are its pictures.
#include <algorithm>

#include "accuracy/report.hpp"
#include "program/page/page.hpp"

namespace meniscus::accuracy {
namespace {

constexpr char kStyle[] = R"css(
:root { --ink: #1c2430; --soft: #5b6675; --line: #dfe4ea; --ground: #fbfbfa; --best: #0b5d3b; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 15px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1500px; margin: 0 auto; padding: 2.5rem 2rem 6rem; }
h1 { font-size: 1.9rem; font-weight: 600; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; font-weight: 600; margin: 2.8rem 0 .4rem; }
p { max-width: 62rem; margin: .3rem 0 .9rem; color: var(--soft); }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1.2rem; margin: 1rem 0; }
dt { color: var(--soft); } dd { margin: 0; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; background: #fff; border: 1px solid var(--line); font-size: 13.5px; }
th, td { padding: .32rem .7rem; border-bottom: 1px solid var(--line); text-align: right;
  font-variant-numeric: tabular-nums; white-space: nowrap; }
thead th { position: sticky; top: 0; background: #f1f3f5; font-weight: 600; z-index: 1; }
th:first-child { text-align: left; position: sticky; left: 0; background: inherit; z-index: 1; }
tbody tr { background: #fff; } tbody tr:hover { background: #f6f8fa; }
tbody th { font-weight: 500; } .unit { color: var(--soft); text-align: left; }
td.meaning { white-space: normal; text-align: left; color: var(--soft); min-width: 24rem;
  font-size: 12.5px; line-height: 1.35; }
.worst { font-weight: 400; font-size: 11.5px; line-height: 1.2; color: var(--soft); }
td.best { font-weight: 700; color: var(--best); }
details { margin: .5rem 0; } summary { cursor: pointer; padding: .2rem 0; }
.gallery th { vertical-align: middle; }
.gallery td { padding: .35rem; text-align: center; vertical-align: top; }
.breakout { width: calc(100vw - 4rem); margin-left: calc(50% - 50vw + 2rem); }
.gallery img { width: clamp(110px, calc((100vw - 15rem) / var(--columns) - .9rem), 420px); display: block; cursor: zoom-in; background: #505050; }
.gallery .caption { font-size: 12px; color: var(--soft); padding-top: .2rem; }
.legend { display: flex; flex-wrap: wrap; gap: .5rem 1.6rem; align-items: center; font-size: 13px;
  color: var(--soft); margin: .6rem 0 1rem; }
.legend i { display: inline-block; width: 1.1rem; height: .85rem; margin-right: .4rem;
  vertical-align: -1px; border: 1px solid #c8ced6; }
.ramp { display: inline-block; width: 12rem; height: .85rem; vertical-align: -1px; margin: 0 .5rem;
  border: 1px solid #c8ced6; background: linear-gradient(90deg, #be0014, #fff, #0032be); }
button { font: inherit; font-size: 13px; padding: .25rem .8rem; border: 1px solid #c3cad3;
  border-radius: 4px; background: #fff; color: var(--ink); cursor: pointer; }
button[aria-pressed=true] { background: var(--ink); color: #fff; border-color: var(--ink); }
#large { position: fixed; inset: 0; display: none; flex-direction: column; align-items: center;
  justify-content: center; background: rgba(15, 20, 27, .93); color: #e8ebef; z-index: 10; }
#large.open { display: flex; }
#large img { max-width: 96vw; max-height: 86vh; min-width: min(1100px, 90vw); image-rendering: pixelated; }
#large p { color: #c7ced8; margin: .8rem; }
)css";

constexpr char kScript[] = R"js(
const cells = [...document.querySelectorAll('.gallery img')];
const large = document.getElementById('large');
const picture = large.querySelector('img'), words = large.querySelector('p');
let second = false, current = -1;
const source = (cell) => second ? cell.dataset.second || cell.dataset.first : cell.dataset.first;
function show() {
  for (const cell of cells) cell.src = source(cell);
  for (const button of document.querySelectorAll('button[data-kind]'))
    button.setAttribute('aria-pressed', String((button.dataset.kind === 'second') === second));
  if (current < 0) { large.classList.remove('open'); return; }
  picture.src = source(cells[current]);
  words.textContent = cells[current].alt + '   (arrow keys: next picture, space: switch, Esc: close)';
  large.classList.add('open');
}
cells.forEach((cell, k) => cell.addEventListener('click', () => { current = k; show(); }));
document.querySelectorAll('button[data-kind]').forEach((button) =>
  button.addEventListener('click', () => { second = button.dataset.kind === 'second'; show(); }));
large.addEventListener('click', () => { current = -1; show(); });
document.addEventListener('keydown', (event) => {
  if (current < 0) return;
  if (event.key === 'Escape') current = -1;
  else if (event.key === 'ArrowRight') current = (current + 1) % cells.length;
  else if (event.key === 'ArrowLeft') current = (current + cells.length - 1) % cells.length;
  else if (event.key === ' ') second = !second;
  else return;
  event.preventDefault();
  show();
});
show();
)js";

std::string element(const char* name, const std::string& content, const char* attributes = "") {
  return std::string("<") + name + attributes + ">" + content + "</" + name + ">";
}

std::string table_of(const Table& table, bool with_meanings) {
  std::string head = element("th", escaped(table.heading)) + "<th class=\"unit\">unit</th>";
  for (const std::string& column : table.columns) head += element("th", escaped(column));
  if (with_meanings) head += "<th class=\"unit\">what it says</th>";
  std::string rows;
  for (const Table::Line& line : table.lines) {
    const Quantity& q = line.quantity;
    std::string row = "<th title=\"" + escaped(q.meaning) + "\">" + escaped(q.name) + "</th>" +
                      element("td", escaped(q.unit), " class=\"unit\"");
    const std::vector<bool> best = best_of(line);
    for (std::size_t k = 0; k < line.values.size(); ++k) {
      std::string cell = shown(q, line.values[k]);
      if (!line.worst.empty() && !line.worst[k].empty())
        cell += "<div class=\"worst\">" + escaped(line.worst[k]) + "</div>";
      row += element("td", cell, best[k] ? " class=\"best\"" : "");
    }
    if (with_meanings) row += element("td", escaped(q.meaning), " class=\"meaning\"");
    rows += element("tr", row) + "\n";
  }
  const std::string body = element("thead", element("tr", head)) + element("tbody", rows);
  return element("div", element("table", body), " class=\"wide\"") + "\n";
}

std::string image_source(const Bytes& png) {
  return png.empty() ? "" : "data:image/png;base64," + base64(png);
}

std::string gallery_of(const Gallery& gallery) {
  std::string rows;
  for (const Gallery::Row& row : gallery.rows) {
    std::string cells = element("th", escaped(row.name));
    for (const Gallery::Cell& cell : row.cells)
      cells += "<td><img alt=\"" + escaped(row.name + ", " + cell.caption) + "\" data-first=\"" +
               image_source(cell.first) + "\" data-second=\"" + image_source(cell.second) +
               "\"><div class=\"caption\">" + escaped(cell.caption) + "</div></td>\n";
    rows += element("tr", cells);
  }
  const std::string buttons = "<p><button data-kind=\"first\">" + escaped(gallery.first_kind) +
                              "</button> <button data-kind=\"second\">" +
                              escaped(gallery.second_kind) + "</button></p>";
  std::size_t columns = 1;
  for (const Gallery::Row& row : gallery.rows) columns = std::max(columns, row.cells.size());
  const std::string style =
      " class=\"gallery\" style=\"--columns: " + std::to_string(columns) + "\"";
  return buttons +
         element("div", element("table", rows, style.c_str()), " class=\"wide breakout\"");
}

constexpr char kLegend[] =
    "<div class=\"legend\"><span>0.2 s in front<span class=\"ramp\"></span>0.2 s behind</span>"
    "<span><i style=\"background:#fff\"></i>right</span>"
    "<span><i style=\"background:#00963c\"></i>missing</span>"
    "<span><i style=\"background:#ffd700\"></i>too much</span>"
    "<span><i style=\"background:#505050\"></i>nothing in either</span></div>";

}  // namespace

std::string html(const Report& report) {
  std::string body =
      element("h1", escaped(report.title)) + element("p", escaped(report.introduction));
  std::string facts;
  for (const auto& [name, value] : report.facts)
    facts += element("dt", escaped(name)) + element("dd", escaped(value));
  body += element("dl", facts) + "\n";
  for (std::size_t k = 0; k < report.tables.size(); ++k) {
    const Table& table = report.tables[k];
    body += element("h2", escaped(table.title));
    if (!table.note.empty()) body += element("p", escaped(table.note));
    body += table_of(table, /*with_meanings=*/k == 0);
  }
  for (const Gallery& gallery : report.galleries) {
    body += element("h2", escaped(gallery.title)) + element("p", escaped(gallery.note));
    if (report.error_legend) body += kLegend;
    body += gallery_of(gallery);
  }
  if (!report.details.empty()) body += element("h2", "In detail");
  for (const Table& table : report.details)
    body += element("details", element("summary", escaped(table.title)) + table_of(table, false));
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>" +
         escaped(report.title) + "</title><style>" + kStyle + "</style></head>\n<body><main>" +
         body + "</main><div id=\"large\"><img alt=\"\"><p></p></div><script>" + kScript +
         "</script></body></html>\n";
}

}  // namespace meniscus::accuracy
