// ROS camera_info YAML: the fields of sensor_msgs/CameraInfo as camera_calibration_parsers writes them.
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "waymark/config/camera_formats.hpp"
#include "waymark/config/yaml_write.hpp"

namespace waymark {
namespace internal {
namespace {

/// A matrix {rows, cols, data}: its numbers row by row, and where they stand.
struct FileMatrix {
  YamlCursor data;
  std::vector<double> values;
};

Result<FileMatrix> read_matrix(const YamlCursor& cursor, std::int64_t rows, std::int64_t least_cols,
                               std::int64_t most_cols) {
  if (Status status = cursor.check_keys({"rows", "cols", "data"}); !status)
    return tl::unexpected<Error>(status.error());
  const auto has_rows = cursor.read_at("rows", [&](const YamlCursor& c) { return c.integer(rows, rows); });
  if (!has_rows) return tl::unexpected<Error>(has_rows.error());
  const auto cols =
      cursor.read_at("cols", [&](const YamlCursor& c) { return c.integer(least_cols, most_cols); });
  if (!cols) return tl::unexpected<Error>(cols.error());
  const auto data = cursor.at("data");
  if (!data) return tl::unexpected<Error>(data.error());
  const auto values = data->numbers();
  if (!values) return tl::unexpected<Error>(values.error());
  if (static_cast<std::int64_t>(values->size()) != rows * *cols) {
    return data->fail_here(ErrorCode::InvalidArgument,
                           fmt::format("{} numbers in a {}x{} matrix", values->size(), rows, *cols),
                           fmt::format("Give {} numbers, row by row.", rows * *cols));
  }
  return FileMatrix{*data, *values};
}

/// fx skew cx / 0 fy cy / 0 0 1
Result<FileIntrinsics> intrinsics_of(const FileMatrix& K) {
  const std::vector<double>& k = K.values;
  if (k[1] != 0.0) {
    return K.data.fail_here(ErrorCode::Unsupported, fmt::format("the skew {} is not zero", k[1]),
                            "Cameras with skewed axes are not supported; calibrate without skew.");
  }
  if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
    return K.data.fail_here(ErrorCode::InvalidArgument, "not a camera matrix",
                            "Its rows are [fx, 0, cx], [0, fy, cy], [0, 0, 1].");
  }
  return FileIntrinsics{k[0], k[4], k[2], k[5]};
}

/// The projection of the rectified image is not used, but one for another resolution betrays mixed files.
Status check_projection(const FileMatrix& P, const FileIntrinsics& k, std::int64_t width,
                        std::int64_t height) {
  const std::vector<double>& p = P.values;
  if (p[0] == 0.0 && p[5] == 0.0) return {};  // not calibrated: all zero
  const std::array ratios = {p[0] / k.fx, p[5] / k.fy, (p[2] + 0.5) / (k.cx + 0.5),
                             (p[6] + 0.5) / (k.cy + 0.5)};
  const double scale = ratios[0];
  bool scaled = std::isfinite(scale) && (scale < 0.7 || scale > 1.4);
  for (const double ratio : ratios) scaled = scaled && std::abs(ratio / scale - 1.0) < 0.1;
  if (!scaled) return {};
  return P.data.fail_here(
      ErrorCode::InvalidArgument,
      fmt::format("the projection matrix is for images of about {:.0f}x{:.0f}, not {}x{}",
                  scale * static_cast<double>(width), scale * static_cast<double>(height), width, height),
      "Take camera_matrix and projection_matrix from the same calibration, with the resolution it was made "
      "for.");
}

Status check_rectification(const YamlCursor& root, const FileIntrinsics& k, std::int64_t width,
                           std::int64_t height) {
  if (const auto rectification = root.find("rectification_matrix")) {
    const auto R = read_matrix(*rectification, 3, 3, 3);
    if (!R) return tl::unexpected<Error>(R.error());
  }
  const auto projection = root.find("projection_matrix");
  if (!projection) return {};
  const auto P = read_matrix(*projection, 3, 4, 4);
  if (!P) return tl::unexpected<Error>(P.error());
  return check_projection(*P, k, width, height);
}

Result<std::int64_t> read_side(const YamlCursor& root, const char* key) {
  return root.read_at(key, [](const YamlCursor& c) { return c.integer(1, kLargestSide); });
}

}  // namespace

bool looks_like_camera_info(const YamlCursor& root) {
  for (const char* key :
       {"camera_matrix", "image_width", "image_height", "distortion_coefficients", "projection_matrix"}) {
    if (root.find(key)) return true;
  }
  return false;
}

Result<NamedCamera> read_camera_info(const YamlCursor& root) {
  Status status =
      root.check_keys({"image_width", "image_height", "camera_name", "camera_matrix", "distortion_model",
                       "distortion_coefficients", "rectification_matrix", "projection_matrix"});
  if (!status) return tl::unexpected<Error>(status.error());
  const auto width = read_side(root, "image_width");
  if (!width) return tl::unexpected<Error>(width.error());
  const auto height = read_side(root, "image_height");
  if (!height) return tl::unexpected<Error>(height.error());
  const auto K = root.read_at("camera_matrix", [](const YamlCursor& c) { return read_matrix(c, 3, 3, 3); });
  if (!K) return tl::unexpected<Error>(K.error());
  const auto intrinsics = intrinsics_of(*K);
  if (!intrinsics) return tl::unexpected<Error>(intrinsics.error());
  const auto D =
      root.read_at("distortion_coefficients", [](const YamlCursor& c) { return read_matrix(c, 1, 0, 14); });
  if (!D) return tl::unexpected<Error>(D.error());
  const auto model = root.at("distortion_model");
  if (!model) return tl::unexpected<Error>(model.error());
  const CameraPlaces places{K->data, root.find("image_width").value_or(root), D->data};
  const auto camera = make_camera(*model, *intrinsics, D->values, *width, *height, places);
  if (!camera) return tl::unexpected<Error>(camera.error());
  status = check_rectification(root, *intrinsics, *width, *height);
  if (!status) return tl::unexpected<Error>(status.error());
  const auto name = root.find("camera_name");
  const auto word = name ? name->text() : Result<std::string>("camera");
  if (!word) return tl::unexpected<Error>(word.error());
  return NamedCamera{.name = *word, .camera = *camera};
}

}  // namespace internal

std::string to_camera_info_yaml(const NamedCamera& named) {
  const CameraModel& camera = named.camera;
  const auto [fx, fy, cx, cy] = internal::intrinsics_text(camera);
  const auto* radtan = std::get_if<PinholeRadtan>(&camera.projection());
  const std::vector<double> d = internal::file_distortion(camera);
  const char* model = radtan == nullptr           ? "equidistant"
                      : radtan->coefficients == 8 ? "rational_polynomial"
                                                  : "plumb_bob";
  const auto matrix = [](const char* key, int rows, std::size_t cols, const std::string& data) {
    return fmt::format("{}:\n  rows: {}\n  cols: {}\n  data: {}\n", key, rows, cols, data);
  };
  return fmt::format("image_width: {}\nimage_height: {}\ncamera_name: {}\n", camera.width_px(),
                     camera.height_px(), yaml_text(named.name)) +
         matrix("camera_matrix", 3, 3,
                fmt::format("[{}, 0.0, {}, 0.0, {}, {}, 0.0, 0.0, 1.0]", fx, cx, fy, cy)) +
         fmt::format("distortion_model: {}\n", model) +
         matrix("distortion_coefficients", 1, d.size(), yaml_list(d)) +
         matrix("rectification_matrix", 3, 3, "[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]") +
         matrix("projection_matrix", 3, 4,
                fmt::format("[{}, 0.0, {}, 0.0, 0.0, {}, {}, 0.0, 0.0, 0.0, 1.0, 0.0]", fx, cx, fy, cy));
}

}  // namespace waymark
