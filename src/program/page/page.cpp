#include "program/page/page.hpp"

#include "base/printable.hpp"

namespace meniscus {
namespace {

constexpr char kStyle[] = R"css(
:root { color-scheme: light dark; --ground: #fbfbfa; --panel: #fff; --ink: #1b2330; --soft: #5a6575;
  --line: #dfe4ea; --grid: #eceff3; --blue: #1f6fb2; --orange: #d1541a; --blue-soft: #b5d6f1;
  --orange-soft: #f7c9b0; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #14181d; --panel: #1b2027; --ink: #e6eaf0; --soft: #9aa6b5; --line: #2e3640;
    --grid: #262d36; --blue: #5aabeb; --orange: #f08a4b; --blue-soft: #23496b;
    --orange-soft: #6a3a1e; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 15px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 2.4rem 1.6rem 5rem; }
h1 { font-size: 1.8rem; font-weight: 650; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.2rem; font-weight: 650; margin: 2.6rem 0 .3rem; }
h3 { font-size: 1rem; font-weight: 600; margin: 1.6rem 0 .3rem; }
p { max-width: 50rem; margin: .25rem 0 .9rem; color: var(--soft); }
p strong { color: var(--ink); font-weight: 600; }
.panel { background: var(--panel); border: 1px solid var(--line); border-radius: 8px;
  padding: 1rem 1.2rem; margin: .6rem 0 1rem; overflow-x: auto; }
svg { width: 100%; height: auto; display: block; font: 12.5px system-ui, "Segoe UI", Arial, sans-serif; }
.grid { stroke: var(--grid); } .tick { fill: var(--soft); } .axis { fill: var(--soft); font-size: 13px; }
.legend { display: flex; flex-wrap: wrap; gap: .3rem 1.6rem; color: var(--soft); font-size: 13px; margin: .2rem 0 .6rem; }
.legend i { display: inline-block; width: .75rem; height: .75rem; border-radius: 50%; margin-right: .4rem; vertical-align: -1px; }
table { border-collapse: collapse; font-size: 13px; width: 100%; }
th, td { padding: .28rem .5rem; border-bottom: 1px solid var(--line); text-align: right;
  font-variant-numeric: tabular-nums; white-space: nowrap; }
th { color: var(--soft); font-weight: 550; } th:first-child, td:first-child, td.word, th.word { text-align: left; }
details { margin: .4rem 0; } summary { cursor: pointer; color: var(--soft); padding: .2rem 0; }
)css";

}  // namespace

std::string html_page(const std::string& title, const std::string& style, const std::string& body) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>" +
         escaped(title) + "</title>\n<style>" + kStyle + style + "</style></head><body><main>\n" +
         body + "</main></body></html>\n";
}

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t left = bytes.size() - k;
    const std::uint32_t three =
        bytes[k] << 16 | (left > 1 ? bytes[k + 1] << 8 : 0) | (left > 2 ? bytes[k + 2] : 0);
    text += kDigits[three >> 18];
    text += kDigits[three >> 12 & 63];
    text += left > 1 ? kDigits[three >> 6 & 63] : '=';
    text += left > 2 ? kDigits[three & 63] : '=';
  }
  return text;
}

}  // namespace meniscus
