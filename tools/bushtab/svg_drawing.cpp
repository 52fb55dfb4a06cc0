#include <fmt/core.h>

#include <array>

#include "drawing.h"

namespace bushtab {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

// Dark where the reader prefers that. The darkest two colours of curves are brighter there.
constexpr const char* kDark =
    "<style>@media(prefers-color-scheme:dark){rect{fill:#0d1117}text{fill:#d6dae0}"
    "[stroke=\"#404040\"]{stroke:#9da7b3}[stroke=\"#dddddd\"]{stroke:#30363d}"
    "[stroke=\"#0072b2\"]{stroke:#3b93d4}[stroke=\"#000000\"]{stroke:#ffffff}}</style>\n";

class SvgDrawing : public Drawing {
 public:
  SvgDrawing(int width, int height)
      : svg_(fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
                         "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"{2}\">\n"
                         "{3}<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
                         width, height, kTextSize, kDark)) {}

  void line(const std::vector<Dot>& dots, const Stroke& stroke) override {
    svg_ +=
        fmt::format("<polyline fill=\"none\" stroke=\"#{:06x}\" stroke-width=\"{:g}\"{} points=\"",
                    stroke.colour, stroke.width, stroke.dashed ? " stroke-dasharray=\"8 4\"" : "");
    const char* space = "";
    for (const Dot& dot : dots) {
      svg_ += fmt::format("{}{:.1f},{:.1f}", space, dot.x, dot.y);
      space = " ";
    }
    svg_ += "\"/>\n";
  }

  void text(Dot at, Anchor anchor, const std::string& text) override {
    constexpr std::array<const char*, 3> kAnchors{"start", "middle", "end"};
    svg_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", at.x,
                        at.y, kAnchors[static_cast<std::size_t>(anchor)], escaped(text));
  }

  bushd::Result<std::string> finish() override { return svg_ + "</svg>\n"; }

 private:
  std::string svg_;
};

}  // namespace

std::unique_ptr<Drawing> svg_drawing(int width, int height) {
  return std::make_unique<SvgDrawing>(width, height);
}

}  // namespace bushtab
