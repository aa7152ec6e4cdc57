// Calibrations in the YAML of OpenCV's FileStorage, with the keys of OpenCV's own calibration program: pixel
// centres at integers.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "waymark/config/camera_formats.hpp"
#include "waymark/config/yaml_write.hpp"

namespace waymark {
namespace internal {
namespace {

/// The first of these keys that is there.
std::optional<YamlCursor> find_any(const YamlCursor& root, const std::vector<const char*>& keys) {
  for (const char* key : keys)
    if (auto found = root.find(key)) return found;
  return std::nullopt;
}

Result<YamlCursor> at_any(const YamlCursor& root, const std::vector<const char*>& keys) {
  if (const auto found = find_any(root, keys)) return *found;
  return root.at(keys.front());
}

Result<std::int64_t> required_side(const YamlCursor& root, const char* key) {
  const auto side = root.find(key);
  if (side) return side->integer(1, kLargestSide);
  return root.fail_here(
      ErrorCode::NotFound, fmt::format("the key {} is missing", key),
      "OpenCV's calibration program writes image_width and image_height: add them by hand.");
}

/// Whether the file says that the lens is a fisheye: a number, as OpenCV writes truth.
Result<bool> is_fisheye(const YamlCursor& root) {
  const auto flag = find_any(root, {"fisheye_model", "fisheye"});
  if (!flag) return false;
  return flag->number().map([](double value) { return value != 0; });
}

}  // namespace

bool looks_like_opencv(const YamlCursor& root) {
  const auto matrix = root.is_map() ? find_any(root, {"camera_matrix", "cameraMatrix", "K"}) : std::nullopt;
  return matrix && matrix->find("dt").has_value();
}

Result<NamedCamera> read_opencv(const YamlCursor& root) {
  const auto width = required_side(root, "image_width");
  if (!width) return tl::unexpected(width.error());
  const auto height = required_side(root, "image_height");
  if (!height) return tl::unexpected(height.error());
  const auto fisheye = is_fisheye(root);
  if (!fisheye) return tl::unexpected(fisheye.error());
  const auto matrix = at_any(root, {"camera_matrix", "cameraMatrix", "K"});
  if (!matrix) return tl::unexpected(matrix.error());
  const auto numbers = matrix->at("data");
  if (!numbers) return tl::unexpected(numbers.error());
  const auto k = numbers->exactly_numbers(9);
  if (!k) return tl::unexpected(k.error());
  if ((*k)[1] != 0 || (*k)[3] != 0 || (*k)[6] != 0 || (*k)[7] != 0 || (*k)[8] != 1)
    return numbers->fail_here(ErrorCode::InvalidArgument, "not a camera matrix",
                              "Its rows are [fx, 0, cx], [0, fy, cy], [0, 0, 1].");
  const auto distortion = at_any(root, {"distortion_coefficients", "dist_coeffs", "distCoeffs", "D"});
  if (!distortion) return tl::unexpected(distortion.error());
  const auto data = distortion->at("data");
  if (!data) return tl::unexpected(data.error());
  const auto d = data->numbers();
  if (!d) return tl::unexpected(d.error());
  const YamlNode model{.kind = YamlNode::Kind::Scalar,
                       .line = data->place().line.value_or(1),
                       .text = *fisheye        ? "equidistant"
                               : d->size() > 5 ? "rational_polynomial"
                                               : "plumb_bob"};
  auto camera =
      make_camera(YamlCursor(model, root.source(), data->place().key), {(*k)[0], (*k)[4], (*k)[2], (*k)[5]},
                  *d, *width, *height, {*numbers, root.find("image_width").value_or(root), *data});
  if (!camera) return tl::unexpected(camera.error());
  return NamedCamera{.name = "opencv", .camera = *std::move(camera)};
}

}  // namespace internal

std::string to_opencv_yaml(const NamedCamera& named) {
  const CameraModel& camera = named.camera;
  const auto [fx, fy, cx, cy] = internal::intrinsics_text(camera);
  std::vector<double> d = internal::file_distortion(camera);
  if (d.empty()) d.assign(5, 0.0);
  const auto matrix = [](const char* key, std::size_t rows, std::size_t cols, const std::string& data) {
    return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: {}\n", key, rows,
                       cols, data);
  };
  std::string text = fmt::format("%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n", camera.width_px(),
                                 camera.height_px());
  if (std::holds_alternative<Equidistant>(camera.projection())) text += "fisheye_model: 1\n";
  return text +
         matrix("camera_matrix", 3, 3,
                fmt::format("[ {}, 0., {}, 0., {}, {}, 0., 0., 1. ]", fx, cx, fy, cy)) +
         matrix("distortion_coefficients", d.size(), 1, yaml_list(d));
}

}  // namespace waymark
