#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace waymark::testing {

/// What a printer would put on paper: grey pixels, 0 black, 255 white.
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
  /// Mean share of ink (0 white, 1 black) of the pixels [x0, x1) x [y0, y1).
  [[nodiscard]] double ink(int x0, int y0, int x1, int y1) const;
};

/// Rasterises a page (from 1) with poppler's pdftoppm, SVG with librsvg's rsvg-convert: two programs that are
/// not ours. A failure is a test failure and gives an empty raster.
Raster rasterise_pdf(const std::vector<std::uint8_t>& pdf, int page, double dpi);
Raster rasterise_svg(const std::vector<std::uint8_t>& svg, double dpi);

/// The words of a PDF, line by line as they stand (poppler's pdftotext), and what pdfinfo says about it.
std::string text_of_pdf(const std::vector<std::uint8_t>& pdf);
std::string info_of_pdf(const std::vector<std::uint8_t>& pdf);

/// Reads a PNG back; its resolution is the one the file records (pHYs), 0 if it records none.
Raster read_png(const std::vector<std::uint8_t>& png);

/// Where ink begins or ends between two places on the page, in mm: the mean over the band [band0_mm,
/// band1_mm) across it, from how much ink lies between the two. One end must be white and the other black.
/// `along_x`: the two places are x, the band is in y.
double edge_mm(const Raster& raster, bool along_x, double from_mm, double to_mm, double band0_mm,
               double band1_mm);

/// Runs a program in a folder and returns what it printed; a failure is a test failure.
std::string output_of(const std::string& command);

}  // namespace waymark::testing
