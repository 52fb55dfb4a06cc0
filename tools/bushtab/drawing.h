// What the pictures are drawn on: lines and text on a white sheet, as SVG or PNG.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"

namespace bushtab {

struct Dot {  // in pixels from the upper left corner
  double x = 0;
  double y = 0;
};

struct Stroke {
  std::uint32_t colour = 0;  // 0xRRGGBB
  double width = 1;
  bool dashed = false;
};

enum class Anchor { kStart, kMiddle, kEnd };

class Drawing {
 public:
  virtual ~Drawing() = default;
  virtual void line(const std::vector<Dot>& dots, const Stroke& stroke) = 0;
  // `at` is on the text's base line. Precondition: UTF-8 without control characters.
  virtual void text(Dot at, Anchor anchor, const std::string& text) = 0;
  // The file's bytes.
  virtual bushd::Result<std::string> finish() = 0;
};

inline constexpr int kTextSize = 13;

// Text stays text, so that it can be searched and does not depend on the fonts of the machine that
// drew it: the same table gives the same bytes everywhere.
std::unique_ptr<Drawing> svg_drawing(int width, int height);
std::unique_ptr<Drawing> png_drawing(int width, int height);

}  // namespace bushtab
