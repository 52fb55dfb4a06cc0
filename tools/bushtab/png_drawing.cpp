#include <cairo.h>

#include <array>

#include "drawing.h"

namespace bushtab {
namespace {

cairo_status_t append(void* bytes, const unsigned char* data, unsigned count) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), count);
  return CAIRO_STATUS_SUCCESS;
}

class PngDrawing : public Drawing {
 public:
  PngDrawing(int width, int height)
      : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)),
        cairo_(cairo_create(surface_.get())) {
    cairo_set_source_rgb(cairo_.get(), 1, 1, 1);
    cairo_paint(cairo_.get());
    cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo_.get(), kTextSize);
  }

  void line(const std::vector<Dot>& dots, const Stroke& stroke) override {
    constexpr std::array<double, 2> kDashes{8, 4};
    const auto share = [&](int shift) { return ((stroke.colour >> shift) & 0xFF) / 255.0; };
    cairo_set_source_rgb(cairo_.get(), share(16), share(8), share(0));
    cairo_set_line_width(cairo_.get(), stroke.width);
    cairo_set_dash(cairo_.get(), kDashes.data(), stroke.dashed ? int{kDashes.size()} : 0, 0);
    for (const Dot& dot : dots) cairo_line_to(cairo_.get(), dot.x, dot.y);
    cairo_stroke(cairo_.get());
  }

  void text(Dot at, Anchor anchor, const std::string& text) override {
    constexpr std::array<double, 3> kShares{0, 0.5, 1};
    cairo_text_extents_t size;
    cairo_text_extents(cairo_.get(), text.c_str(), &size);
    const double left = size.x_advance * kShares[static_cast<std::size_t>(anchor)];
    cairo_set_source_rgb(cairo_.get(), 0, 0, 0);
    cairo_move_to(cairo_.get(), at.x - left, at.y);
    cairo_show_text(cairo_.get(), text.c_str());
    cairo_new_path(cairo_.get());
  }

  bushd::Result<std::string> finish() override {
    std::string bytes;
    cairo_status_t status = cairo_status(cairo_.get());
    if (status == CAIRO_STATUS_SUCCESS) {
      status = cairo_surface_write_to_png_stream(surface_.get(), append, &bytes);
    }
    if (status != CAIRO_STATUS_SUCCESS) {
      return bushd::fail(std::string("cairo cannot draw it: ") + cairo_status_to_string(status));
    }
    return bytes;
  }

 private:
  struct Release {
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
    void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
  };
  std::unique_ptr<cairo_surface_t, Release> surface_;
  std::unique_ptr<cairo_t, Release> cairo_;
};

}  // namespace

std::unique_ptr<Drawing> png_drawing(int width, int height) {
  return std::make_unique<PngDrawing>(width, height);
}

}  // namespace bushtab
