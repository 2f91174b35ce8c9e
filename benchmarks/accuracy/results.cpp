#include "accuracy/results.hpp"

#include <algorithm>
#include <cmath>

namespace meniscus::accuracy {
namespace {

constexpr const char* kKeyFigures[] = {"normal_rms",   "angle_median", "crease_rms", "crease_angle",
                                       "outline_miss", "iou",          "holes",      "flicker",
                                       "jitter",       "jitter_p999"};

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

/// All figures of one scene, or mean.
Table all_figures(const Group& group, const std::string& title) {
  Table table{title, "", methods_of(group), {}, "figure"};
  const auto add = [&](const Quantity& quantity, const auto& value_of) {
    Table::Line line{quantity, {}};
    for (const Row* row : group) line.values.push_back(value_of(*row));
    if (any_measured(line)) table.lines.push_back(std::move(line));
  };
  for (const FigureField& field : figure_fields())
    add({field.name, field.unit, field.digits, field.better, field.meaning},
        [&](const Row& row) { return row.figures.*field.value; });
  add({"time", "ms", 0, Better::low, "Wall time of extracting the first frame, on this machine."},
      [](const Row& row) { return 1000 * row.seconds; });
  return table;
}

/// One figure, a line for each group.
Table one_figure(const FigureField& field, const std::vector<std::pair<std::string, Group>>& groups,
                 const std::string& heading) {
  Table table{field.name, field.meaning, methods_of(groups[0].second), {}, heading};
  for (const auto& [name, group] : groups) {
    Table::Line line{{name, field.unit, field.digits, field.better, field.meaning}, {}};
    for (const Row* row : group) line.values.push_back(row->figures.*field.value);
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

}  // namespace

Row mean_of(const std::vector<Row>& rows, const std::string& scene) {
  Row result{rows[0].series, rows[0].setting, scene, rows[0].method, rows[0].smooth, {}, 0};
  std::vector<Figures> figures;
  for (const Row& row : rows) {
    figures.push_back(row.figures);
    result.seconds += row.seconds / static_cast<double>(rows.size());
  }
  result.figures = mean(figures);
  return result;
}

nlohmann::json to_json(const Row& row) {
  nlohmann::json figures;
  for (const FigureField& field : figure_fields()) {
    const double value = row.figures.*field.value;
    figures[field.name] = std::isnan(value) ? nlohmann::json() : nlohmann::json(value);
  }
  return {{"series", row.series}, {"setting", row.setting}, {"scene", row.scene},
          {"method", row.method}, {"seconds", row.seconds}, {"figures", std::move(figures)}};
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
