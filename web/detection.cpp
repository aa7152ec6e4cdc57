// Tags in an image that the page has put into memory: the project's own detector, then the refinement of the
// corners, like `waymark detect --set detector.detector=waymark`.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <emscripten.h>

#include <fmt/format.h>

#include "answer.hpp"
#include "waymark/tags/detector/waymark_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark::web {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Kept between images, so that its memory and the index of the codes are created once.
struct Workspace {
  std::vector<std::uint8_t> pixels;
  std::string family;
  std::unique_ptr<Detector> detector;
};

Workspace& workspace() {
  static Workspace kept;
  return kept;
}

std::string failure(const Error& error) { return fmt::format("{{\"error\":{}}}", quoted(to_string(error))); }

/// Root mean square standard deviation of a coordinate.
double sigma_px(const RefinedCorners& corners) { return std::sqrt(corners.covariance_px2.trace() / 8); }

std::string tag_json(const TagDetection& found, const RefinedCorners& corners) {
  return fmt::format(R"({{"tag":"{}","hamming":{},"refinement":"{}","sigma_px":{:.4g},"corners_px":{}}})",
                     to_string(found.tag), found.hamming, to_string(corners.outcome), sigma_px(corners),
                     points(corners.corners_px));
}

std::string detect(int width, int height, const std::string& family) {
  Workspace& own = workspace();
  if (!own.detector || own.family != family) {
    Result<std::unique_ptr<Detector>> made =
        make_waymark_detector({.detector = "waymark", .families = {family}});
    if (!made) return failure(made.error());
    own.detector = std::move(*made);
    own.family = family;
  }
  const ImageView image{own.pixels.data(), width, height, width};
  const Clock::time_point start = Clock::now();
  const Result<std::vector<TagDetection>> found = own.detector->detect(image);
  if (!found) return failure(found.error());
  const double detect_ms = ms_since(start);
  std::vector<RefinedCorners> refined;
  refined.reserve(found->size());
  for (const TagDetection& tag : *found) refined.push_back(refine_corners(image, tag));
  const double refine_ms = ms_since(start) - detect_ms;
  std::string tags;
  for (std::size_t i = 0; i < found->size(); ++i) {
    tags += (i == 0 ? "" : ",") + tag_json((*found)[i], refined[i]);
  }
  return fmt::format(R"({{"detect_ms":{:.3f},"refine_ms":{:.3f},"tags":[{}]}})", detect_ms, refine_ms, tags);
}

/// The printed tag, cell by cell: 0 black, 255 white, 128 outside the tag.
std::string tag_cells(const std::string& name, int number) {
  const Result<FamilyId> id = parse_family(name);
  if (!id) return failure(id.error());
  return fmt::format(R"({{"width":{},"cells":[{}]}})", family(*id).total_width,
                     fmt::join(bitmap({*id, number}), ","));
}

}  // namespace
}  // namespace waymark::web

extern "C" {

/// Memory for a grey image, row by row; the page fills it before waymark_detect. Null for a size that no
/// detector accepts.
EMSCRIPTEN_KEEPALIVE std::uint8_t* waymark_pixels(int width, int height) {
  using namespace waymark;
  if (width <= 0 || height <= 0 || std::int64_t{width} * height > kMaxImagePixels) return nullptr;
  std::vector<std::uint8_t>& pixels = web::workspace().pixels;
  pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  return pixels.data();
}

/// JSON: times and tags, or an error. The size must be that of the last waymark_pixels.
EMSCRIPTEN_KEEPALIVE const char* waymark_detect(int width, int height, const char* family) {
  return waymark::web::keep(waymark::web::detect(width, height, family));
}

/// JSON: the cells of a printed tag, or an error. No cells for a number that the family does not have.
EMSCRIPTEN_KEEPALIVE const char* waymark_tag(const char* family, int number) {
  return waymark::web::keep(waymark::web::tag_cells(family, number));
}
}
