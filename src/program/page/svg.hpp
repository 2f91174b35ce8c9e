// Drawings as SVG, whose classes the page's style colours.
#pragma once

#include <string>

namespace meniscus {

class Svg {
 public:
  /// `width` x `height` units, drawn as wide as the page; `label` is for those who cannot see it.
  Svg(double width, double height, const std::string& label, const std::string& kind = "");

  void line(const std::string& kind, double x0, double y0, double x1, double y1);

  /// `anchor` is start, middle or end; `angle` in degrees, clockwise.
  void words(const std::string& kind, double x, double y, const char* anchor,
             const std::string& what, double angle = 0);

  /// An element as it is.
  void add(const std::string& element) { text_ += element; }

  std::string text() const { return text_ + "</svg>\n"; }

 private:
  std::string text_;
};

}  // namespace meniscus
