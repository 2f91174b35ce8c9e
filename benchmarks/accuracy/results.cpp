#include "accuracy/results.hpp"

#include <algorithm>
#include <cmath>

namespace meniscus::accuracy {
namespace {

constexpr const char* kKeyFigures[] = {
    "normal_rms",   "angle_median", "angle_p95",    "jump_p999",  "rough", "torn",     "crease_rms",
    "crease_angle", "rim_angle",    "outline_miss", "iou",        "holes", "averted",  "flicker",
    "jitter",       "jitter_p999",  "moved",        "moved_p999", "bent",  "bent_p999"};

/// The rows that stand side by side in a table.
using Group = std::vector<const Row*>;

std::vector<std::string> methods_of(const Group& group) {
  std::vector<std::string> methods;
  for (const Row* row : group) methods.push_back(row->method);
  return methods;
}

bool any_measured(const Table::Line& line) {
  return std::any_of(line.values.begin(), line.values.end(),
                     [](double value) { return !std::isnan(value); });
}

/// The worst of the scenes and its name; nothing where it looks like their mean.
std::string worst_shown(const Row& row, const Quantity& quantity, std::size_t field) {
  if (row.worst.empty() || row.worst[field].scene.empty()) return "";
  const std::string value = shown(quantity, row.worst[field].value);
  if (value == shown(quantity, row.figures.*figure_fields()[field].value)) return "";
  return value + " " + row.worst[field].scene;
}

/// One figure of all rows of the group.
Table::Line line_of(const Group& group, const FigureField& field, const std::string& name) {
  Table::Line line{{name, field.unit, field.digits, field.better, field.meaning}, {}};
  const auto place = static_cast<std::size_t>(&field - figure_fields().data());
  for (const Row* row : group) {
    line.values.push_back(row->figures.*field.value);
    line.worst.push_back(worst_shown(*row, line.quantity, place));
  }
  return line;
}

/// All figures of one scene, or mean.
Table all_figures(const Group& group, const std::string& title) {
  Table table{title, "", methods_of(group), {}, "figure"};
  const auto add = [&](Table::Line line) {
    if (any_measured(line)) table.lines.push_back(std::move(line));
  };
  for (const FigureField& field : figure_fields()) add(line_of(group, field, field.name));
  Table::Line time{
      {"time", "ms", 0, Better::low, "Wall time of extracting the first frame, on this machine."},
      {}};
  for (const Row* row : group) time.values.push_back(1000 * row->seconds);
  add(std::move(time));
  return table;
}

/// One figure, a line for each group.
Table one_figure(const FigureField& field, const std::vector<std::pair<std::string, Group>>& groups,
                 const std::string& heading) {
  Table table{field.name, field.meaning, methods_of(groups[0].second), {}, heading};
  for (const auto& [name, group] : groups) {
    Table::Line line = line_of(group, field, name);
    if (any_measured(line)) table.lines.push_back(std::move(line));
  }
  return table;
}

const FigureField& field_named(const std::string& name) {
  return *std::find_if(figure_fields().begin(), figure_fields().end(),
                       [&](const FigureField& field) { return field.name == name; });
}

/// The distinct values of a member, in the order of the rows.
template <class Value>
std::vector<std::string> names_in(const std::vector<Row>& rows, const Value& value) {
  std::vector<std::string> names;
  for (const Row& row : rows)
    if (std::find(names.begin(), names.end(), value(row)) == names.end())
      names.push_back(value(row));
  return names;
}

std::string setting_of(const Row& row) {
  return row.series == row.setting ? row.series : row.series + ", " + row.setting;
}

/// Whether a is worse than b, which may be NaN.
bool is_worse(Better better, double a, double b) {
  if (std::isnan(a) || better == Better::neither) return false;
  if (std::isnan(b)) return true;
  if (better == Better::near_zero) return std::abs(a) > std::abs(b);
  return better == Better::high ? a < b : a > b;
}

std::vector<Worst> worst_of(const std::vector<Row>& rows) {
  std::vector<Worst> all;
  for (const FigureField& field : figure_fields()) {
    Worst& worst = all.emplace_back();
    for (const Row& row : rows)
      if (is_worse(field.better, row.figures.*field.value, worst.value))
        worst = {row.figures.*field.value, row.scene};
  }
  return all;
}

}  // namespace

Row mean_of(const std::vector<Row>& rows, const std::string& scene) {
  Row result{rows[0].series, rows[0].setting, scene, rows[0].method, rows[0].smooth, {}, 0, {}};
  std::vector<Figures> figures;
  for (const Row& row : rows) {
    figures.push_back(row.figures);
    result.seconds += row.seconds / static_cast<double>(rows.size());
  }
  result.figures = mean(figures);
  if (rows.front().scene != rows.back().scene) result.worst = worst_of(rows);
  return result;
}

nlohmann::json to_json(const Row& row) {
  nlohmann::json figures;
  for (const FigureField& field : figure_fields()) {
    const double value = row.figures.*field.value;
    figures[field.name] = std::isnan(value) ? nlohmann::json() : nlohmann::json(value);
  }
  nlohmann::json result{{"series", row.series},   {"setting", row.setting},
                        {"scene", row.scene},     {"method", row.method},
                        {"seconds", row.seconds}, {"figures", std::move(figures)}};
  for (std::size_t k = 0; k < row.worst.size(); ++k)
    if (!row.worst[k].scene.empty())
      result["worst"][figure_fields()[k].name] = {{"value", row.worst[k].value},
                                                  {"scene", row.worst[k].scene}};
  return result;
}

void add_tables(const std::vector<Row>& rows, Report& report) {
  if (rows.empty()) return;
  const std::vector<std::string> settings = names_in(rows, setting_of);
  const auto group = [&](const std::string& setting, const std::string& scene) {
    Group found;
    for (const Row& row : rows)
      if (setting_of(row) == setting && row.scene == scene) found.push_back(&row);
    return found;
  };
  const std::vector<std::string> scenes = names_in(rows, [](const Row& row) { return row.scene; });
  const auto is_mean = [](const std::string& scene) {
    return scene == kMean || scene == kSmoothMean;
  };

  // Lines are scenes where there is one setting, else settings.
  const bool one_setting = settings.size() == 1;
  std::vector<std::pair<std::string, Group>> lines;
  if (one_setting) {
    for (const char* scene : {kMean, kSmoothMean})
      if (const Group found = group(settings[0], scene); !found.empty())
        report.tables.push_back(all_figures(found, scene == std::string(kMean)
                                                       ? "Mean over the scenes"
                                                       : "Mean over the smooth scenes"));
    for (const std::string& scene : scenes)
      if (!is_mean(scene)) lines.emplace_back(scene, group(settings[0], scene));
  } else {
    for (const std::string& setting : settings) lines.emplace_back(setting, group(setting, kMean));
  }
  for (const char* name : kKeyFigures)
    if (Table table = one_figure(field_named(name), lines, one_setting ? "scene" : "setting");
        lines.size() > 1 && !table.lines.empty())
      report.tables.push_back(std::move(table));
  for (const std::string& setting : settings)
    for (const std::string& scene : scenes)
      if (const Group found = group(setting, scene);
          !found.empty() && !(one_setting && is_mean(scene)))
        report.details.push_back(all_figures(found, setting + ": " + scene));
}

}  // namespace meniscus::accuracy
