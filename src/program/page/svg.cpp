#include "program/page/svg.hpp"

#include "base/printed.hpp"
#include "program/page/page.hpp"

namespace meniscus {

Svg::Svg(double width, double height, const std::string& label, const std::string& kind)
    : text_(printed("<svg%s viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"%s\">\n",
                    kind.empty() ? "" : (" class=\"" + kind + "\"").c_str(), width, height,
                    escaped(label).c_str())) {}

void Svg::line(const std::string& kind, double x0, double y0, double x1, double y1) {
  text_ += printed("<line class=\"%s\" x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\"/>\n",
                   kind.c_str(), x0, y0, x1, y1);
}

void Svg::words(const std::string& kind, double x, double y, const char* anchor,
                const std::string& what, double angle) {
  const std::string place =
      angle == 0 ? printed("x=\"%.1f\" y=\"%.1f\"", x, y)
                 : printed("transform=\"translate(%.1f %.1f) rotate(%.1f)\"", x, y, angle);
  text_ += printed("<text class=\"%s\" text-anchor=\"%s\" %s>%s</text>\n", kind.c_str(), anchor,
                   place.c_str(), escaped(what).c_str());
}

}  // namespace meniscus
