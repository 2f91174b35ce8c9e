// What the scenes gave, as rows, JSON and a report.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "accuracy/figures.hpp"
#include "accuracy/report.hpp"

namespace meniscus::accuracy {

/// The worst of the scenes behind a mean; no scene: there is none.
struct Worst {
  double value = kNone;
  std::string scene;
};

/// The figures of one method on one scene, or a mean.
struct Row {
  std::string series, setting, scene, method;
  bool smooth = false;  // as the scene is
  Figures figures;
  double seconds = 0;
  std::vector<Worst> worst{};  // of a mean over scenes: one a figure, in the order of the fields
};

/// The mean of rows of one setting and method, as the row of `scene`; over several scenes with the
/// worst of them.
Row mean_of(const std::vector<Row>& rows, const std::string& scene);

nlohmann::json to_json(const Row& row);

inline constexpr char kMean[] = "mean", kSmoothMean[] = "smooth mean";  // scenes of mean rows

/// The tables of a report. Of one setting: the means, and the key figures scene by scene; of
/// several: the means of the key figures setting by setting. All else as details. Rows come setting
/// by setting and, in each, with the methods in one order.
void add_tables(const std::vector<Row>& rows, Report& report);

}  // namespace meniscus::accuracy
