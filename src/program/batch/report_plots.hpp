// Drawings over the number of the frame, as SVG.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "program/batch/report.hpp"

namespace meniscus {

/// What a plot shows of a frame; none: nothing.
using FrameValue = std::function<std::optional<double>(const FrameRecord&)>;

struct PlotLayer {
  std::string kind;  // its class, which the page's style colours
  std::string name;
  FrameValue value;  // >= 0
};

/// One bar a frame, its layers on top of each other; of very many, the highest of neighbours.
/// `unit` follows the values; frames that failed are marked. Empty when no frame has a value.
std::string stacked_plot(const BatchReport& report, const std::string& label,
                         const std::string& unit, const std::vector<PlotLayer>& layers);

/// A curve over the frames that are done, with gaps where they have no value, from 0 on.
std::string curve_plot(const BatchReport& report, const std::string& label, const std::string& unit,
                       const FrameValue& value);

/// What became of each frame, as one coloured line over their numbers.
std::string status_strip(const BatchReport& report);

}  // namespace meniscus
