// The roofline plot: operations a second over operations a byte, both logarithmic.
#include <algorithm>
#include <cmath>

#include "base/printed.hpp"
#include "kernels/page.hpp"
#include "program/page/page.hpp"
#include "program/page/svg.hpp"

namespace meniscus::bench {
namespace {

constexpr double kWidth = 960, kHeight = 560;
constexpr double kLeft = 64, kRight = 24, kTop = 20, kBottom = 52;

struct Box {
  double x0, y0, x1, y1;
};

bool overlap(const Box& a, const Box& b) {
  return a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;
}

// A logarithmic axis.
struct Axis {
  double low, high;   // values at its ends
  double begin, end;  // pixels at its ends
  double at(double value) const {
    return begin + (end - begin) * std::log(value / low) / std::log(high / low);
  }
};

struct Dot {
  const Result* result;
  std::vector<const Result*> trail;  // the sizes, smallest first
  double x, y;
};

class Plot {
 public:
  Plot(const Session& session, const std::vector<std::string>& near)
      : session_(session),
        near_(near),
        svg_(kWidth, kHeight, "Roofline of " + title_of(session), "roofline") {
    for (const Result& r : session.results)
      if (r.variant == kDevice && !r.whole_stage && r.operations > 0 && r.bytes > 0) add(r);
    double low_x = 0.25, high_x = 16, low_y = session.roofline.peak_gflops() / 30, high_y = 1;
    for (const Dot& dot : dots_)
      for (const Result* r : dot.trail) {
        low_x = std::min(low_x, r->intensity() / 1.6);
        high_x = std::max(high_x, r->intensity() * 2.5);
        low_y = std::min(low_y, r->gflops() / 2);
        high_y = std::max(high_y, r->gflops());
      }
    high_y = 1.7 * std::max(high_y, session.roofline.peak_gflops());
    x_ = {low_x, high_x, kLeft, kWidth - kRight};
    y_ = {low_y, high_y, kHeight - kBottom, kTop};
    for (Dot& dot : dots_) {
      dot.x = x_.at(dot.result->intensity());
      dot.y = y_.at(dot.result->gflops());
    }
  }

  std::string svg() {
    draw_axes();
    draw_roofs();
    draw_dots();
    return svg_.text();
  }

 private:
  void add(const Result& r) {
    auto dot = std::find_if(dots_.begin(), dots_.end(),
                            [&](const Dot& d) { return d.result->kernel == r.kernel; });
    if (dot == dots_.end()) dot = dots_.insert(dots_.end(), Dot{&r, {}, 0, 0});
    dot->trail.push_back(&r);
    if (r.particles > dot->result->particles) dot->result = &r;
  }

  void draw_axes() {
    for (double power = std::pow(2, std::ceil(std::log2(x_.low))); power <= x_.high; power *= 2) {
      svg_.line("grid", x_.at(power), y_.begin, x_.at(power), y_.end);
      const std::string label = power < 1 ? "1/" + printed("%g", 1 / power) : printed("%g", power);
      svg_.words("tick", x_.at(power), y_.begin + 18, "middle", label);
    }
    for (double decade = std::pow(10, std::floor(std::log10(y_.low))); decade <= y_.high;
         decade *= 10)
      for (const double step : {1, 2, 5}) {
        const double value = decade * step;
        if (value < y_.low || value > y_.high) continue;
        svg_.line("grid", x_.begin, y_.at(value), x_.end, y_.at(value));
        svg_.words("tick", x_.begin - 8, y_.at(value) + 4, "end", printed("%g", value));
      }
    svg_.words("axis", (x_.begin + x_.end) / 2, kHeight - 10, "middle",
               "arithmetic intensity: operations for each byte read or written");
    svg_.words("axis", 16, (y_.begin + y_.end) / 2, "middle", "GFLOP/s", -90);
  }

  // A diagonal of the given bandwidth up to the ceiling.
  void draw_memory_roof(const CopyRate& copy, double ceiling, const char* kind) {
    const double knee = std::min(ceiling / copy.gb_per_s, x_.high);
    const double start = std::max(x_.low, y_.low / copy.gb_per_s);
    svg_.line(kind, x_.at(start), y_.at(start * copy.gb_per_s), x_.at(knee),
              y_.at(knee * copy.gb_per_s));
    const double dx = x_.at(knee) - x_.at(start);
    const double dy = y_.at(knee * copy.gb_per_s) - y_.at(start * copy.gb_per_s);
    const double length = std::hypot(dx, dy);
    if (!(length > 0)) return;
    // Above the line, near its lower end.
    const double along = 12;
    const double x = x_.at(start) + along * dx / length + 7 * dy / length;
    const double y = y_.at(start * copy.gb_per_s) + along * dy / length - 7 * dx / length;
    const std::string label =
        three_digits(copy.gb_per_s) + " GB/s, " + size_of(static_cast<std::uint64_t>(copy.bytes));
    svg_.words("roof-label", x, y, "start", label, std::atan2(dy, dx) * 180 / std::acos(-1.0));
  }

  void draw_roofs() {
    const Roofline& roofline = session_.roofline;
    if (roofline.copy.empty()) return;
    const double peak = roofline.peak_gflops();
    const CopyRate& fastest =
        *std::max_element(roofline.copy.begin(), roofline.copy.end(),
                          [](const auto& a, const auto& b) { return a.gb_per_s < b.gb_per_s; });
    const double knee = std::clamp(peak / fastest.gb_per_s, x_.low, x_.high);
    svg_.line("roof", x_.at(knee), y_.at(peak), x_.end, y_.at(peak));
    svg_.words("roof-label", x_.end - 4, y_.at(peak) - 7, "end",
               printed("%s GFLOP/s %s", three_digits(peak).c_str(),
                       peak == roofline.fused_gflops ? "fused multiply-add" : "products and sums"));
    if (roofline.plain_gflops < 0.93 * peak) {
      const double begin = std::clamp(roofline.plain_gflops / fastest.gb_per_s, x_.low, x_.high);
      svg_.line("roof second", x_.at(begin), y_.at(roofline.plain_gflops), x_.end,
                y_.at(roofline.plain_gflops));
      svg_.words("roof-label", x_.end - 4, y_.at(roofline.plain_gflops) + 15, "end",
                 three_digits(roofline.plain_gflops) + " GFLOP/s products and sums");
    }
    draw_memory_roof(fastest, peak, "roof");
    const CopyRate& largest = roofline.copy.back();
    if (largest.gb_per_s < 0.93 * fastest.gb_per_s) draw_memory_roof(largest, peak, "roof second");
  }

  std::string tooltip(const Result& r) const {
    const Share share = share_of_roofline(r, session_.roofline);
    return printed("%s, %s particles: %s ms, %s GFLOP/s, %s GB/s, %.0f %% of the roofline (%s)",
                   r.kernel.c_str(), grouped(r.particles).c_str(),
                   three_digits(r.best_ms()).c_str(), three_digits(r.gflops()).c_str(),
                   three_digits(r.gb_per_s()).c_str(), 100 * share.value, share.limit.c_str());
  }

  void circle(const Result& r, const std::string& kind, double radius) {
    svg_.add(
        printed("<circle class=\"%s\" cx=\"%.1f\" cy=\"%.1f\" r=\"%.1f\"><title>%s</title>"
                "</circle>\n",
                kind.c_str(), x_.at(r.intensity()), y_.at(r.gflops()), radius,
                escaped(tooltip(r)).c_str()));
  }

  // Beside the dot where nothing is yet, else farther away with a line to it.
  void place_label(const Dot& dot, std::vector<Box>& taken) {
    const double width = 6.9 * static_cast<double>(dot.result->kernel.size()) + 2, height = 15;
    for (double distance = 9; distance < 160; distance += 8)
      for (const double angle : {0.0, 180.0, 35.0, -35.0, 145.0, -145.0, 90.0, -90.0}) {
        const double radians = angle * std::acos(-1.0) / 180;
        const double dx = std::cos(radians), dy = -std::sin(radians);
        const double x = dot.x + distance * dx - width * (0.5 - 0.5 * dx);
        const double y = dot.y + distance * dy - height * (0.5 - 0.5 * dy);
        const Box box{x, y, x + width, y + height};
        const bool inside =
            box.x0 > x_.begin && box.x1 < x_.end && box.y0 > y_.end && box.y1 < y_.begin;
        if (!inside || std::any_of(taken.begin(), taken.end(),
                                   [&](const Box& other) { return overlap(box, other); }))
          continue;
        if (distance > 18)
          svg_.line("leader", dot.x + 7 * dx, dot.y + 7 * dy, dot.x + (distance - 1) * dx,
                    dot.y + (distance - 1) * dy);
        svg_.words("dot-label", x + 1, y + 12, "start", dot.result->kernel);
        taken.push_back(box);
        return;
      }
  }

  void draw_dots() {
    std::vector<Box> taken;
    for (const Dot& dot : dots_) {
      taken.push_back({dot.x - 7, dot.y - 7, dot.x + 7, dot.y + 7});
      for (const Result* r : dot.trail) {
        const double x = x_.at(r->intensity()), y = y_.at(r->gflops());
        taken.push_back({x - 3, y - 3, x + 3, y + 3});
        taken.push_back(
            {std::min(x, dot.x), std::min(y, dot.y), std::max(x, dot.x), std::max(y, dot.y)});
      }
    }
    for (const Dot& dot : dots_) {
      const bool good = std::count(near_.begin(), near_.end(), dot.result->kernel) > 0;
      const std::string kind = good ? "near" : "far";
      std::vector<const Result*> trail = dot.trail;
      std::sort(trail.begin(), trail.end(),
                [](const Result* a, const Result* b) { return a->particles < b->particles; });
      std::string points;
      for (const Result* r : trail)
        points += printed("%.1f,%.1f ", x_.at(r->intensity()), y_.at(r->gflops()));
      svg_.add("<polyline class=\"trail " + kind + "\" points=\"" + points + "\"/>\n");
      for (const Result* r : trail)
        if (r != dot.result) circle(*r, "small " + kind, 3);
      circle(*dot.result, "dot " + kind, 6.5);
    }
    for (const Dot& dot : dots_) place_label(dot, taken);
  }

  const Session& session_;
  const std::vector<std::string>& near_;
  std::vector<Dot> dots_;
  Axis x_{}, y_{};
  Svg svg_;
};

}  // namespace

std::string roofline_plot(const Session& session, const std::vector<std::string>& near) {
  return Plot(session, near).svg();
}

}  // namespace meniscus::bench
