#include "tests/support/raster.hpp"

#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <memory>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"

namespace waymark::testing {
namespace {

using Bytes = std::vector<std::uint8_t>;

void write_file(const std::filesystem::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

Bytes read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Binary PGM as pdftoppm writes it.
Raster read_pgm(const std::filesystem::path& path, double dpi) {
  std::ifstream in(path, std::ios::binary);
  std::string magic;
  Raster raster;
  int maximum = 0;
  in >> magic >> raster.width >> raster.height >> maximum;
  in.get();
  if (magic != "P5" || maximum != 255) return {};
  raster.dpi = dpi;
  raster.grey.resize(static_cast<std::size_t>(raster.width) * static_cast<std::size_t>(raster.height));
  in.read(reinterpret_cast<char*>(raster.grey.data()), static_cast<std::streamsize>(raster.grey.size()));
  return in ? raster : Raster{};
}

std::uint32_t big_endian(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) << 24U | static_cast<std::uint32_t>(bytes[1]) << 16U |
         static_cast<std::uint32_t>(bytes[2]) << 8U | bytes[3];
}

double recorded_dpi(const Bytes& png) {
  constexpr std::string_view kName = "pHYs";
  const auto at = std::search(png.begin(), png.end(), kName.begin(), kName.end());
  if (png.end() - at < 13) return 0.0;
  const std::uint8_t* data = &*at + 4;
  if (big_endian(data) != big_endian(data + 4) || data[8] != 1) return 0.0;
  return big_endian(data) * 0.0254;
}

struct Reader {
  std::span<const std::uint8_t> rest;

  static cairo_status_t read(void* self, unsigned char* out, unsigned int count) {
    auto& rest = static_cast<Reader*>(self)->rest;
    if (rest.size() < count) return CAIRO_STATUS_READ_ERROR;
    std::memcpy(out, rest.data(), count);
    rest = rest.subspan(count);
    return CAIRO_STATUS_SUCCESS;
  }
};

}  // namespace

double Raster::ink(int x0, int y0, int x1, int y1) const {
  double sum = 0.0;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) sum += 1.0 - at(x, y) / 255.0;
  }
  return sum / ((x1 - x0) * (y1 - y0));
}

std::string output_of(const std::string& command) {
  FILE* pipe =
      popen((command + " 2>&1").c_str(), "r");  // NOLINT(cert-env33-c): a test runs the programs it names
  if (pipe == nullptr) {
    ADD_FAILURE() << "cannot run " << command;
    return {};
  }
  std::string text;
  std::array<char, 4096> buffer{};
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  const int code = pclose(pipe);
  EXPECT_EQ(code, 0) << command << "\n" << text;
  return text;
}

Raster rasterise_pdf(const Bytes& pdf, int page, double dpi) {
  const auto folder = fresh_folder("raster");
  write_file(folder / "page.pdf", pdf);
  output_of("cd '" + folder.string() + "' && pdftoppm -gray -singlefile -r " + std::to_string(dpi) + " -f " +
            std::to_string(page) + " page.pdf page");
  Raster raster = read_pgm(folder / "page.pgm", dpi);
  EXPECT_FALSE(raster.empty());
  return raster;
}

std::string text_of_pdf(const Bytes& pdf) {
  const auto folder = fresh_folder("text");
  write_file(folder / "page.pdf", pdf);
  return output_of("cd '" + folder.string() + "' && pdftotext -layout page.pdf -");
}

std::string info_of_pdf(const Bytes& pdf) {
  const auto folder = fresh_folder("info");
  write_file(folder / "page.pdf", pdf);
  return output_of("cd '" + folder.string() + "' && pdfinfo -isodates page.pdf");
}

Raster rasterise_svg(const Bytes& svg, double dpi) {
  const auto folder = fresh_folder("raster");
  write_file(folder / "page.svg", svg);
  const std::string resolution = std::to_string(dpi);
  output_of("cd '" + folder.string() + "' && rsvg-convert --dpi-x " + resolution + " --dpi-y " + resolution +
            " -o page.png page.svg");
  Raster raster = read_png(read_file(folder / "page.png"));
  raster.dpi = dpi;
  return raster;
}

Raster read_png(const Bytes& png) {
  Reader reader{png};
  cairo_surface_t* surface = cairo_image_surface_create_from_png_stream(Reader::read, &reader);
  Raster raster;
  if (cairo_surface_status(surface) == CAIRO_STATUS_SUCCESS) {
    raster = {cairo_image_surface_get_width(surface),
              cairo_image_surface_get_height(surface),
              recorded_dpi(png),
              {}};
    const unsigned char* data = cairo_image_surface_get_data(surface);
    const int stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < raster.height; ++y) {
      // The page is opaque and black, white or grey, so one of the four channels is sufficient.
      for (int x = 0; x < raster.width; ++x)
        raster.grey.push_back(data[static_cast<std::ptrdiff_t>(y) * stride + std::ptrdiff_t{4} * x + 1]);
    }
  }
  cairo_surface_destroy(surface);
  EXPECT_FALSE(raster.empty()) << "unreadable PNG";
  return raster;
}

double edge_mm(const Raster& raster, bool along_x, double from_mm, double to_mm, double band0_mm,
               double band1_mm) {
  const double scale = raster.px_per_mm();
  const auto pixel = [&](double mm) { return static_cast<int>(std::lround(mm * scale)); };
  const int p0 = pixel(from_mm);
  const int p1 = pixel(to_mm);
  const int b0 = pixel(band0_mm);
  const int b1 = std::max(pixel(band1_mm), b0 + 1);
  const auto ink = [&](int q0, int q1) {
    return along_x ? raster.ink(q0, b0, q1, b1) : raster.ink(b0, q0, b1, q1);
  };
  const bool starts_black = ink(p0, p0 + 1) > 0.5;
  EXPECT_NEAR(ink(p0, p0 + 1), starts_black ? 1.0 : 0.0, 0.01) << "at " << from_mm;
  EXPECT_NEAR(ink(p1 - 1, p1), starts_black ? 0.0 : 1.0, 0.01) << "at " << to_mm;
  const double inked_px = ink(p0, p1) * (p1 - p0);
  return (starts_black ? p0 + inked_px : p1 - inked_px) / scale;
}

}  // namespace waymark::testing
