#include "program/batch/report_plots.hpp"

#include <algorithm>
#include <cmath>

#include "base/printed.hpp"
#include "program/page/page.hpp"
#include "program/page/svg.hpp"

namespace meniscus {
namespace {

constexpr double kLeft = 46, kRight = 8, kTop = 8, kBottom = 24;  // around a plot
constexpr std::size_t kMostTooltips = 500;

// The step 1, 2 or 5 times a power of ten that cuts `range` into at most `parts`.
double round_step(double range, int parts) {
  const double least = range / parts;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1, 2, 5})
    if (factor * power >= least * (1 - 1e-9)) return factor * power;
  return 10 * power;
}

// "0.5", "250", "2.5 k": a number at an axis.
std::string tick_text(double value) {
  constexpr const char* kPrefixes[] = {"", " k", " M", " G", " T"};
  int prefix = 0;
  for (; std::abs(value) >= 1000 && prefix < 4; ++prefix) value /= 1000;
  return printed("%g%s", value, kPrefixes[prefix]);
}

// Where frames lie from left to right.
struct FrameAxis {
  std::int64_t first = 0, last = 0, step = 1;
  double begin, end;

  FrameAxis(const BatchReport& report, double width) : begin(kLeft), end(width - kRight) {
    std::vector<std::int64_t> numbers = report.missing;
    for (const FrameHistory& f : report.frames) numbers.push_back(f.last.frame);
    if (numbers.empty()) return;
    std::sort(numbers.begin(), numbers.end());
    first = numbers.front();
    last = numbers.back();
    step = std::max<std::int64_t>(1, last - first);
    for (std::size_t k = 1; k < numbers.size(); ++k)
      step = std::min(step, numbers[k] - numbers[k - 1]);
  }
  double slot() const {  // the width of a frame
    return (end - begin) * static_cast<double>(step) / static_cast<double>(last - first + step);
  }
  double at(std::int64_t frame) const {  // the middle of its slot
    return begin + slot() * (static_cast<double>(frame - first) / static_cast<double>(step) + 0.5);
  }
};

void draw_frame_numbers(Svg& svg, const FrameAxis& frames, double y) {
  const auto range = static_cast<double>(frames.last - frames.first);
  const auto step = std::max<std::int64_t>(
      1, static_cast<std::int64_t>(range > 0 ? round_step(range, (frames.end - frames.begin) / 90)
                                             : 1));
  const std::int64_t over = ((frames.first % step) + step) % step;
  for (std::int64_t n = frames.first + (over ? step - over : 0); n <= frames.last; n += step) {
    const std::string number = std::to_string(n);
    const double half = 4.0 * static_cast<double>(number.size());
    const bool inside = frames.at(n) + half < frames.end + kRight;
    svg.words("tick", inside ? frames.at(n) : frames.end + kRight, y, inside ? "middle" : "end",
              number);
  }
}

// Axes and marks that all plots share.
class Plot {
 public:
  Plot(const BatchReport& report, const std::string& label, double width, double height,
       double highest)
      : report_(report),
        frames_(report, width),
        svg_(width, height, label),
        top_(kTop),
        bottom_(height - kBottom) {
    const double step = round_step(highest > 0 ? highest : 1, height > 200 ? 5 : 4);
    high_ = step * std::ceil((highest > 0 ? highest : 1) / step - 1e-9);
    for (double value = 0; value <= high_ * (1 + 1e-9); value += step) {
      svg_.line("grid", frames_.begin, y(value), frames_.end, y(value));
      svg_.words("tick", frames_.begin - 6, y(value) + 4, "end", tick_text(value));
    }
    draw_frame_numbers(svg_, frames_, height - 6);
  }

  double x(std::int64_t frame) const { return frames_.at(frame); }
  double y(double value) const { return bottom_ - (bottom_ - top_) * value / high_; }
  double slot() const { return frames_.slot(); }
  std::int64_t step() const { return frames_.step; }
  Svg& svg() { return svg_; }

  /// Marks at the frames that failed, then what the pointer says of each frame.
  std::string finish(const std::function<std::string(const FrameRecord&)>& words) {
    const double wide = std::max(1.5, std::min(0.82 * slot(), 10.0));
    for (const FrameHistory& f : report_.frames) {
      if (f.last.status != FrameStatus::failed) continue;
      svg_.add(printed(
          "<rect class=\"failed mark\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"/>\n",
          x(f.last.frame) - wide / 2, top_, wide, bottom_ - top_));
    }
    if (report_.frames.size() <= kMostTooltips)
      for (const FrameHistory& f : report_.frames)
        svg_.add(printed(
            "<rect class=\"over\" x=\"%.1f\" y=\"%.0f\" width=\"%.1f\" height=\"%.0f\">"
            "<title>frame %lld: %s</title></rect>\n",
            x(f.last.frame) - slot() / 2, top_, slot(), bottom_ - top_,
            static_cast<long long>(f.last.frame),
            escaped(f.last.status == FrameStatus::failed ? "failed" : words(f.last)).c_str()));
    return svg_.text();
  }

 private:
  const BatchReport& report_;
  FrameAxis frames_;
  Svg svg_;
  double top_, bottom_, high_ = 1;
};

}  // namespace

std::string stacked_plot(const BatchReport& report, const std::string& label,
                         const std::string& unit, const std::vector<PlotLayer>& layers) {
  const auto sum_of = [&](const FrameRecord& record) {
    std::optional<double> sum;
    for (const PlotLayer& layer : layers)
      if (const auto value = layer.value(record)) sum = sum.value_or(0) + *value;
    return sum;
  };
  double highest = -1;
  for (const FrameHistory& f : report.frames)
    highest = std::max(highest, sum_of(f.last).value_or(-1));
  if (highest < 0) return "";

  Plot plot(report, label, 1120, 240, highest);
  // Where a frame has less than a line's width, the highest of its neighbours stands for them.
  const auto together = static_cast<std::size_t>(std::max(1.0, std::ceil(2 / plot.slot())));
  struct Bar {
    const FrameRecord* record;
    double x, base;  // its middle, and the value that it has reached
  };
  std::vector<Bar> bars;
  for (std::size_t k = 0; k < report.frames.size(); k += together) {
    const auto begin = report.frames.begin() + static_cast<std::ptrdiff_t>(k);
    const auto end =
        begin + static_cast<std::ptrdiff_t>(std::min(together, report.frames.size() - k));
    const auto highest_of =
        std::max_element(begin, end, [&](const FrameHistory& x, const FrameHistory& y) {
          return sum_of(x.last).value_or(-1) < sum_of(y.last).value_or(-1);
        });
    bars.push_back(
        {&highest_of->last, (plot.x(begin->last.frame) + plot.x((end - 1)->last.frame)) / 2, 0});
  }
  const double room = plot.slot() * static_cast<double>(together);
  const double wide = room > 4 ? 0.82 * room : room;
  for (const PlotLayer& layer : layers) {
    std::string path;
    for (Bar& bar : bars) {
      const double value = layer.value(*bar.record).value_or(0);
      if (!(value > 0)) continue;
      path += printed("M%.2f %.1fV%.1fh%.2fV%.1fz", bar.x - wide / 2, plot.y(bar.base),
                      plot.y(bar.base + value), wide, plot.y(bar.base));
      bar.base += value;
    }
    plot.svg().add("<path class=\"" + layer.kind + "\" d=\"" + path + "\"/>\n");
  }
  return plot.finish([&](const FrameRecord& record) {
    std::string words;
    for (const PlotLayer& layer : layers)
      if (const auto value = layer.value(record))
        words += (words.empty() ? "" : ", ") + layer.name + " " + three_digits(*value) + " " + unit;
    return words.empty() ? to_string(record.status) : words;
  });
}

std::string curve_plot(const BatchReport& report, const std::string& label, const std::string& unit,
                       const FrameValue& value) {
  double highest = -1;
  for (const FrameHistory& f : report.frames)
    highest = std::max(highest, value(f.last).value_or(-1));
  if (highest < 0) return "";

  Plot plot(report, label, 560, 170, highest);
  std::string path;
  std::vector<std::pair<double, double>> points;
  std::int64_t before = 0;
  bool open = false;
  for (const FrameHistory& f : report.frames) {
    const auto height = value(f.last);
    if (height) {
      const double x = plot.x(f.last.frame), y = plot.y(*height);
      path += printed(open && f.last.frame - before == plot.step() ? "L%.1f %.1f" : "M%.1f %.1fh0",
                      x, y);
      points.emplace_back(x, y);
    }
    open = height.has_value();
    before = f.last.frame;
  }
  plot.svg().add("<path class=\"curve\" d=\"" + path + "\"/>\n");
  if (plot.slot() > 7)
    for (const auto& [x, y] : points)
      plot.svg().add(
          printed("<circle class=\"point\" cx=\"%.1f\" cy=\"%.1f\" r=\"2.4\"/>\n", x, y));
  return plot.finish([&](const FrameRecord& record) {
    const auto height = value(record);
    if (!height) return std::string(to_string(record.status));
    const bool whole = *height == std::round(*height);
    return (whole ? grouped(std::llround(*height)) : three_digits(*height)) + " " + unit;
  });
}

std::string status_strip(const BatchReport& report) {
  Svg svg(1120, 46, "What became of each frame");
  const FrameAxis frames(report, 1120);
  const double wide = frames.slot() > 4 ? 0.86 * frames.slot() : frames.slot();
  // `from` to `to` are of one kind. Bad ones stay wide enough to be seen.
  const auto piece = [&](const char* kind, std::int64_t from, std::int64_t to, const char* words) {
    const double width =
        std::max(frames.at(to) - frames.at(from) + wide, kind == std::string("done") ? 0.5 : 3.0);
    const std::string title = from == to
                                  ? "frame " + std::to_string(from)
                                  : "frames " + std::to_string(from) + " to " + std::to_string(to);
    svg.add(
        printed("<rect class=\"%s\" x=\"%.2f\" y=\"4\" width=\"%.2f\" height=\"18\"><title>%s: "
                "%s</title></rect>\n",
                kind, (frames.at(from) + frames.at(to) - width) / 2, width, title.c_str(), words));
  };
  // Neighbours in one piece where they would touch.
  const auto pieces = [&](const char* kind, const std::vector<std::int64_t>& numbers,
                          const char* words) {
    for (std::size_t k = 0; k < numbers.size();) {
      std::size_t last = k;
      while (frames.slot() <= 4 && last + 1 < numbers.size() &&
             numbers[last + 1] - numbers[last] == frames.step)
        ++last;
      piece(kind, numbers[k], numbers[last], words);
      k = last + 1;
    }
  };
  std::vector<std::int64_t> done, warned, skipped, failed;
  for (const FrameHistory& f : report.frames) {
    const bool good = f.last.warnings.empty();
    (f.last.status == FrameStatus::failed    ? failed
     : f.last.status == FrameStatus::skipped ? skipped
     : good                                  ? done
                                             : warned)
        .push_back(f.last.frame);
  }
  pieces("done", done, "done");
  pieces("skipped", skipped, "there already");
  pieces("warned", warned, "done, with warnings");
  pieces("missing", report.missing, "missing");
  pieces("failed", failed, "failed");
  draw_frame_numbers(svg, frames, 40);
  return svg.text();
}

}  // namespace meniscus
