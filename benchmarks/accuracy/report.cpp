#include "accuracy/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace meniscus::accuracy {

std::string shown(const Quantity& quantity, double value) {
  if (std::isnan(value)) return "–";
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", quantity.digits, value);
  return text;
}

std::vector<bool> best_of(const Table::Line& line) {
  // What is compared is what is shown: no value is better by digits that nobody sees.
  std::vector<double> losses;
  for (const double value : line.values) {
    if (std::isnan(value)) {
      losses.push_back(value);
      continue;
    }
    const double seen = std::strtod(shown(line.quantity, value).c_str(), nullptr);
    switch (line.quantity.better) {
      case Better::low:
        losses.push_back(seen);
        break;
      case Better::high:
        losses.push_back(-seen);
        break;
      case Better::near_zero:
        losses.push_back(std::abs(seen));
        break;
      case Better::neither:
        losses.push_back(kNone);
        break;
    }
  }
  double best = kNone, worst = kNone;
  for (const double loss : losses) {
    if (std::isnan(loss)) continue;
    best = std::isnan(best) ? loss : std::min(best, loss);
    worst = std::isnan(worst) ? loss : std::max(worst, loss);
  }
  std::vector<bool> is_best;
  for (const double loss : losses) is_best.push_back(loss == best && best < worst);
  return is_best;
}

std::string markdown(const Report& report) {
  std::string text;
  for (const auto& [name, value] : report.facts) text += "- " + name + ": " + value + "\n";
  for (const Table& table : report.tables) {
    text += "\n#### " + table.title + "\n\n";
    if (!table.note.empty()) text += table.note + "\n\n";
    text += "| " + table.heading + " | unit |";
    for (const std::string& column : table.columns) text += " `" + column + "` |";
    text += "\n|---|---|" + [&] {
      std::string rule;
      for (std::size_t k = 0; k < table.columns.size(); ++k) rule += "--:|";
      return rule;
    }() + "\n";
    for (const Table::Line& line : table.lines) {
      text += "| " + line.quantity.name + " | " + line.quantity.unit + " |";
      const std::vector<bool> best = best_of(line);
      for (std::size_t k = 0; k < line.values.size(); ++k) {
        const std::string value = shown(line.quantity, line.values[k]);
        text += best[k] ? " **" + value + "**" : " " + value;
        if (!line.worst.empty() && !line.worst[k].empty()) text += " (" + line.worst[k] + ")";
        text += " |";
      }
      text += "\n";
    }
  }
  return text;
}

}  // namespace meniscus::accuracy
