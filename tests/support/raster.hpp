#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace waymark::testing {

/// A page as a printer renders it: grey pixels, 0 black, 255 white.
struct Raster {
  int width = 0;
  int height = 0;
  double dpi = 0;
  std::vector<std::uint8_t> grey;

  [[nodiscard]] bool empty() const { return grey.empty(); }
  [[nodiscard]] std::uint8_t at(int x, int y) const {
    return grey[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] double px_per_mm() const { return dpi / 25.4; }
  /// Mean fraction of ink (0 white, 1 black) of the pixels [x0, x1) x [y0, y1).
  [[nodiscard]] double ink(int x0, int y0, int x1, int y1) const;
};

/// Rasterises a page (from 1) with poppler's pdftoppm, SVG with librsvg's rsvg-convert: two independent
/// programs. A failure is a test failure and returns an empty raster.
Raster rasterise_pdf(const std::vector<std::uint8_t>& pdf, int page, double dpi);
Raster rasterise_svg(const std::vector<std::uint8_t>& svg, double dpi);

/// The text of a PDF, line by line in layout order (poppler's pdftotext), and the output of pdfinfo.
std::string text_of_pdf(const std::vector<std::uint8_t>& pdf);
std::string info_of_pdf(const std::vector<std::uint8_t>& pdf);

/// Decodes a PNG; its resolution is that of the file (pHYs), 0 if it has none.
Raster read_png(const std::vector<std::uint8_t>& png);

/// Position of an ink edge between two positions on the page, in mm: the mean over the transverse band
/// [band0_mm, band1_mm), from the amount of ink between the two. One end must be white and the other black.
/// `along_x`: the two positions are in x, the band is in y.
double edge_mm(const Raster& raster, bool along_x, double from_mm, double to_mm, double band0_mm,
               double band1_mm);

/// Runs a program in a folder and returns its output; a failure is a test failure.
std::string output_of(const std::string& command);

}  // namespace waymark::testing
