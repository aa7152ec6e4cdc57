// ROS camera_info YAML: the fields of sensor_msgs/CameraInfo as written by camera_calibration_parsers. kalibr
// camchain: https://github.com/ethz-asl/kalibr/wiki/yaml-formats. TagSLAM uses the same format with
// additional keys. OpenCV: FileStorage YAML with the keys used by OpenCV's calibration program; pixel centres
// at integers. PhotonVision: OpenCV's matrices as JSON; pixel centres at integers.
#include "waymark/config/exchange/camera_formats.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "waymark/base/message_text.hpp"
#include "waymark/camera/calibration_numbers.hpp"
#include "waymark/config/yaml_tree.hpp"

namespace waymark::internal {
namespace {

/// Offset between the pixel centres in the files (at integers) and in Waymark (at +1/2; docs/conventions.md).
constexpr double kHalfPixel = 0.5;

/// Adds the place of the values in the file to an error from camera_from().
Error with_place(Error error, const YamlCursor& model, const CameraPlaces& places) {
  const std::string key = error.place.key;
  const bool about_size = key == "resolution" || key == "roi";
  const bool about_matrix = key == "camera_matrix";
  const YamlCursor& cursor = about_size                  ? places.resolution
                             : key == "distortion"       ? places.distortion
                             : key == "distortion_model" ? model
                                                         : places.intrinsics;
  const bool named = about_size || about_matrix || key == "distortion" || key == "distortion_model";
  error.place = cursor.place();
  if (!named && !key.empty()) error.message = fmt::format("{}: {}", key, error.message);
  return error;
}

/// c_x or c_y as text for the file: the shortest decimal that reads back as the same value.
std::string centre_text(double centre_px) {
  constexpr int kAllDigits = 17;
  const double in_file = centre_px - kHalfPixel;
  for (int digits = 1; digits <= kAllDigits; ++digits) {
    const std::string text = fmt::format("{:.{}g}", in_file, digits);
    double value = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    if (value + kHalfPixel == centre_px) return yaml_number(value);
  }
  return yaml_number(in_file);
}

}  // namespace

Result<CameraModel> make_camera(const YamlCursor& model, const FileIntrinsics& intrinsics,
                                const std::vector<double>& distortion, std::int64_t width_px,
                                std::int64_t height_px, const CameraPlaces& places) {
  const auto name = model.text();
  if (!name) return tl::unexpected<Error>(name.error());
  auto camera = camera_from({.model = *name,
                             .k = intrinsics,
                             .distortion = distortion,
                             .width_px = width_px,
                             .height_px = height_px,
                             .part = places.part});
  if (!camera) return tl::unexpected<Error>(with_place(camera.error(), model, places));
  return camera;
}

std::array<std::string, 4> intrinsics_text(const CameraModel& camera) {
  return std::visit(
      [](const auto& c) {
        return std::array{yaml_number(c.fx), yaml_number(c.fy), centre_text(c.cx), centre_text(c.cy)};
      },
      camera.projection());
}

double skew_of(const CameraModel& camera) {
  return std::visit([](const auto& c) { return c.skew; }, camera.projection());
}

std::vector<double> file_distortion(const CameraModel& camera) {
  if (const auto* fisheye = std::get_if<Equidistant>(&camera.projection())) {
    return {fisheye->k.begin(), fisheye->k.end()};
  }
  const auto& radtan = std::get<PinholeRadtan>(camera.projection());
  return {radtan.k.begin(), radtan.k.begin() + radtan.coefficients};
}

}  // namespace waymark::internal

namespace waymark {
namespace internal {
namespace {

/// A matrix {rows, cols, data}, with its numbers row by row and their place in the file.
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

FileIntrinsics intrinsics_of(const std::vector<double>& nine) {
  FileIntrinsics k{};
  std::copy_n(nine.begin(), k.size(), k.begin());
  return k;
}

/// The projection of the rectified image is not used, but a different resolution indicates mixed files.
Status check_projection(const FileMatrix& P, const FileIntrinsics& k, std::int64_t width,
                        std::int64_t height) {
  const std::vector<double>& p = P.values;
  if (p[0] == 0.0 && p[5] == 0.0) return {};  // not calibrated: all zero
  const std::array ratios = {p[0] / k[0], p[5] / k[4], (p[2] + 0.5) / (k[2] + 0.5),
                             (p[6] + 0.5) / (k[5] + 0.5)};
  const double scale = ratios[0];
  bool scaled = std::isfinite(scale) && (scale < 0.7 || scale > 1.4);
  for (const double ratio : ratios) scaled = scaled && std::abs(ratio / scale - 1.0) < 0.1;
  if (!scaled) return {};
  return P.data.fail_here(
      ErrorCode::InvalidArgument,
      fmt::format("the projection matrix is for images of about {:.0f}x{:.0f}, not {}x{}",
                  scale * static_cast<double>(width), scale * static_cast<double>(height), width, height),
      "Take camera_matrix and projection_matrix from the same calibration, with the resolution of the "
      "calibration.");
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

/// Reads the optional keys binning_x, binning_y and roi of a CameraInfo message saved as YAML.
Result<ImagePart> read_part(const YamlCursor& root) {
  ImagePart part;
  Status status;
  const auto take = [&](const YamlCursor& in, const char* key, std::int64_t& value) {
    const auto found = in.find(key);
    if (!found || !status) return;
    const auto number = found->integer(0, kLargestSide);
    if (number)
      value = *number;
    else
      status = tl::unexpected<Error>(number.error());
  };
  take(root, "binning_x", part.binning_x);
  take(root, "binning_y", part.binning_y);
  if (const auto roi = root.find("roi")) {
    take(*roi, "x_offset", part.x_px);
    take(*roi, "y_offset", part.y_px);
    take(*roi, "width", part.width_px);
    take(*roi, "height", part.height_px);
  }
  if (!status) return tl::unexpected<Error>(status.error());
  return part;
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
  Status status = root.check_keys({"image_width", "image_height", "camera_name", "camera_matrix",
                                   "distortion_model", "distortion_coefficients", "rectification_matrix",
                                   "projection_matrix", "binning_x", "binning_y", "roi"});
  if (!status) return tl::unexpected<Error>(status.error());
  const auto width = read_side(root, "image_width");
  if (!width) return tl::unexpected<Error>(width.error());
  const auto height = read_side(root, "image_height");
  if (!height) return tl::unexpected<Error>(height.error());
  const auto K = root.read_at("camera_matrix", [](const YamlCursor& c) { return read_matrix(c, 3, 3, 3); });
  if (!K) return tl::unexpected<Error>(K.error());
  const FileIntrinsics intrinsics = intrinsics_of(K->values);
  const auto D =
      root.read_at("distortion_coefficients", [](const YamlCursor& c) { return read_matrix(c, 1, 0, 14); });
  if (!D) return tl::unexpected<Error>(D.error());
  const auto model = root.at("distortion_model");
  if (!model) return tl::unexpected<Error>(model.error());
  const auto part = read_part(root);
  if (!part) return tl::unexpected<Error>(part.error());
  const CameraPlaces places{K->data, root.find("image_width").value_or(root), D->data, *part};
  const auto camera = make_camera(*model, intrinsics, D->values, *width, *height, places);
  if (!camera) return tl::unexpected<Error>(camera.error());
  status = check_rectification(root, intrinsics, *width, *height);
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
  const std::string skew = yaml_number(internal::skew_of(camera));
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
                fmt::format("[{}, {}, {}, 0.0, {}, {}, 0.0, 0.0, 1.0]", fx, skew, cx, fy, cy)) +
         fmt::format("distortion_model: {}\n", model) +
         matrix("distortion_coefficients", 1, d.size(), yaml_list(d)) +
         matrix("rectification_matrix", 3, 3, "[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]") +
         matrix("projection_matrix", 3, 4,
                fmt::format("[{}, {}, {}, 0.0, 0.0, {}, {}, 0.0, 0.0, 0.0, 1.0, 0.0]", fx, skew, cx, fy, cy));
}

namespace internal {
namespace {

const std::vector<std::string>& known_keys() {
  static const std::vector<std::string> kKeys = {
      "camera_model",
      "intrinsics",
      "distortion_model",
      "distortion_coeffs",
      "resolution",
      "rostopic",
      "T_cam_imu",
      "T_cn_cnm1",
      "timeshift_cam_imu",
      "cam_overlaps",
      // TagSLAM keys
      "tagtopic",
      "rig_body",
      "wiggle_rotation",
      "wiggle_translation",
      "frame_id",
      "is_static",
  };
  return kKeys;
}

Status check_camera_model(const YamlCursor& entry) {
  const auto model = entry.at("camera_model");
  const auto word = entry.read_at("camera_model", &YamlCursor::text);
  if (!word) return tl::unexpected<Error>(word.error());
  if (*word == "pinhole") return {};
  const std::array unsupported = {"omni", "eucm", "ds"};
  if (std::find(unsupported.begin(), unsupported.end(), *word) != unsupported.end()) {
    return model->fail_here(ErrorCode::Unsupported,
                            fmt::format("the camera model '{}' is not supported", *word),
                            "Calibrate with pinhole-radtan, or pinhole-equi for a fisheye.");
  }
  return model->fail_here(ErrorCode::Unsupported,
                          fmt::format("unknown camera model '{}'", word->substr(0, 40)),
                          suggestion(*word, {"pinhole"}));
}

Result<std::array<std::int64_t, 2>> read_resolution(const YamlCursor& cursor) {
  if (const auto two = cursor.exactly_numbers(2); !two) return tl::unexpected<Error>(two.error());
  std::array<std::int64_t, 2> sides{};
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto side = cursor.children()[i].integer(1, kLargestSide);
    if (!side) return tl::unexpected<Error>(side.error());
    sides.at(i) = *side;
  }
  return sides;
}

/// Reads four rows of four numbers that form a rotation and a translation.
Result<std::optional<Eigen::Matrix4d>> read_transform(const YamlCursor& entry, const char* key) {
  const auto cursor = entry.find(key);
  if (!cursor) return std::optional<Eigen::Matrix4d>();
  const auto rows = cursor->children();
  if (!cursor->is_sequence() || rows.size() != 4) {
    return cursor->fail_here(ErrorCode::InvalidArgument, "not a 4x4 matrix",
                             "Give four rows of four numbers.");
  }
  Eigen::Matrix4d T;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto row = rows[i].exactly_numbers(4);
    if (!row) return tl::unexpected<Error>(row.error());
    T.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVector4d>(row->data());
  }
  constexpr double kTolerance = 1e-3;  // accepts matrices typed with three or four digits
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool rotates = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
                       R.col(0).dot(R.col(1).cross(R.col(2))) > 0.0;
  if (!rotates || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return cursor->fail_here(ErrorCode::InvalidArgument, "not a rotation and a translation",
                             "Its rows are [R t] with a rotation R, and [0, 0, 0, 1].");
  }
  return std::optional<Eigen::Matrix4d>(T);
}

/// Reads a camera's optional keys, all except those of its intrinsics.
Result<NamedCamera> read_extras(const YamlCursor& entry, NamedCamera named) {
  const auto imu = read_transform(entry, "T_cam_imu");
  if (!imu) return tl::unexpected<Error>(imu.error());
  named.cam_T_imu = *imu;
  const auto previous = read_transform(entry, "T_cn_cnm1");
  if (!previous) return tl::unexpected<Error>(previous.error());
  named.cam_T_previous = *previous;
  if (const auto topic = entry.find("rostopic")) {
    const auto word = topic->text();
    if (!word) return tl::unexpected<Error>(word.error());
    named.topic = *word;
  }
  if (const auto shift = entry.find("timeshift_cam_imu")) {
    const auto seconds = shift->number();
    if (!seconds) return tl::unexpected<Error>(seconds.error());
    named.imu_minus_cam_time_s = *seconds;
  }
  return named;
}

std::string transform_text(const char* key, const std::optional<Eigen::Matrix4d>& T) {
  if (!T) return {};
  std::string text = fmt::format("  {}:\n", key);
  for (Eigen::Index i = 0; i < 4; ++i) {
    const Eigen::RowVector4d row = T->row(i);
    text += fmt::format("  - {}\n", yaml_list({row.data(), 4}));
  }
  return text;
}

}  // namespace

std::vector<std::string> camchain_names(const YamlCursor& root) {
  std::vector<std::string> names;
  for (std::size_t i = 0; root.is_map() && i < root.node().keys.size(); ++i) {
    const YamlNode& value = root.node().items[i];
    const auto has = [&](const char* key) {
      return std::find(value.keys.begin(), value.keys.end(), key) != value.keys.end();
    };
    const std::string& key = root.node().keys[i];
    if (has("camera_model") || has("intrinsics") || has("distortion_coeffs") || key.starts_with("cam")) {
      names.push_back(key);
    }
  }
  return names;
}

Result<NamedCamera> read_camchain_camera(const YamlCursor& entry, std::string name) {
  Status status = entry.check_keys(known_keys());
  if (status) status = check_camera_model(entry);
  if (!status) return tl::unexpected<Error>(status.error());
  const auto numbers = entry.read_at("intrinsics", [](const YamlCursor& c) { return c.exactly_numbers(4); });
  if (!numbers) return tl::unexpected<Error>(numbers.error());
  const auto size = entry.read_at("resolution", &read_resolution);
  if (!size) return tl::unexpected<Error>(size.error());
  const auto model = entry.at("distortion_model");
  if (!model) return tl::unexpected<Error>(model.error());
  const auto coefficients = entry.find("distortion_coeffs");
  const auto distortion =
      coefficients ? coefficients->numbers() : Result<std::vector<double>>(std::vector<double>());
  if (!distortion) return tl::unexpected<Error>(distortion.error());
  const FileIntrinsics k{(*numbers)[0], 0, (*numbers)[2], 0, (*numbers)[1], (*numbers)[3], 0, 0, 1};
  const CameraPlaces places{entry.find("intrinsics").value_or(entry),
                            entry.find("resolution").value_or(entry),
                            coefficients.value_or(*model),
                            {}};
  const auto camera = make_camera(*model, k, *distortion, (*size)[0], (*size)[1], places);
  if (!camera) return tl::unexpected<Error>(camera.error());
  return read_extras(entry, NamedCamera{.name = std::move(name), .camera = *camera});
}

}  // namespace internal

Result<std::string> to_camchain_yaml(const std::vector<NamedCamera>& cameras) {
  std::string text;
  for (const NamedCamera& named : cameras) {
    const CameraModel& camera = named.camera;
    const auto* radtan = std::get_if<PinholeRadtan>(&camera.projection());
    if (radtan != nullptr && radtan->coefficients == 8) {
      return fail(ErrorCode::Unsupported,
                  fmt::format("camchains do not support the rational model of camera '{}'", named.name), {},
                  "Write camera_info YAML instead.");
    }
    if (internal::skew_of(camera) != 0.0)
      return fail(ErrorCode::Unsupported,
                  fmt::format("camchains do not support the skew of camera '{}'", named.name), {},
                  "Write camera_info YAML instead.");
    const auto [fx, fy, cx, cy] = internal::intrinsics_text(camera);
    const std::vector<double> d = internal::file_distortion(camera);
    const char* model = radtan == nullptr ? "equidistant" : d.empty() ? "none" : "radtan";
    text += fmt::format("{}:\n", yaml_text(named.name));
    text += internal::transform_text("T_cam_imu", named.cam_T_imu);
    text += internal::transform_text("T_cn_cnm1", named.cam_T_previous);
    text += fmt::format("  camera_model: pinhole\n  distortion_coeffs: {}\n  distortion_model: {}\n",
                        yaml_list(d), model);
    text += fmt::format("  intrinsics: [{}, {}, {}, {}]\n", fx, fy, cx, cy);
    text += fmt::format("  resolution: [{}, {}]\n", camera.width_px(), camera.height_px());
    if (!named.topic.empty()) text += fmt::format("  rostopic: {}\n", yaml_text(named.topic));
    if (named.imu_minus_cam_time_s) {
      text += fmt::format("  timeshift_cam_imu: {}\n", yaml_number(*named.imu_minus_cam_time_s));
    }
  }
  return text;
}

namespace internal {
namespace {

/// The first of these keys that exists.
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
  return root.fail_here(ErrorCode::NotFound, fmt::format("the key {} is missing", key),
                        "Add image_width and image_height, which OpenCV's calibration program writes.");
}

/// Whether the file marks the lens as a fisheye. OpenCV writes this bool as a number.
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
  auto camera = make_camera(YamlCursor(model, root.source(), data->place().key), intrinsics_of(*k), *d,
                            *width, *height, {*numbers, root.find("image_width").value_or(root), *data, {}});
  if (!camera) return tl::unexpected(camera.error());
  return NamedCamera{.name = "opencv", .camera = *std::move(camera)};
}

}  // namespace internal

std::string to_opencv_yaml(const NamedCamera& named) {
  const CameraModel& camera = named.camera;
  const double skew = internal::skew_of(camera);
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
                fmt::format("[ {}, {}, {}, 0., {}, {}, 0., 0., 1. ]", fx,
                            skew == 0.0 ? "0." : yaml_number(skew), cx, fy, cy)) +
         matrix("distortion_coefficients", d.size(), 1, yaml_list(d));
}

}  // namespace waymark

namespace waymark::internal {
namespace {

/// Reads the length of an image side; PhotonVision writes integers as 1280.0.
Result<std::int64_t> side_of(const YamlCursor& cursor) {
  const Result<double> value = cursor.number();
  if (!value) return tl::unexpected(value.error());
  const auto side =
      static_cast<std::int64_t>(std::min(std::max(*value, 0.0), static_cast<double>(kLargestSide)));
  if (static_cast<double>(side) != *value || side == 0)
    return cursor.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is not a size in pixels", *value));
  return side;
}

/// Older versions of PhotonVision call the distortion cameraExtrinsics.
Result<YamlCursor> distortion_of(const YamlCursor& root) {
  const auto older = root.find("cameraExtrinsics");
  return older && !root.find("distCoeffs") ? Result<YamlCursor>(*older) : root.at("distCoeffs");
}

Status check_lens(const YamlCursor& root) {
  const auto lens = root.find("lensmodel");
  if (!lens) return {};
  const Result<std::string> name = lens->text();
  if (!name) return tl::unexpected(name.error());
  if (*name == "LENSMODEL_OPENCV" || *name == "LENSMODEL_OPENCV5" || *name == "LENSMODEL_OPENCV8") return {};
  return lens->fail_here(ErrorCode::Unsupported, fmt::format("unknown lens model '{}'", name->substr(0, 40)),
                         "Known: LENSMODEL_OPENCV, LENSMODEL_OPENCV5, LENSMODEL_OPENCV8.");
}

}  // namespace

bool looks_like_photonvision(const YamlCursor& root) {
  return root.is_map() && root.find("cameraIntrinsics").has_value();
}

Result<NamedCamera> read_photonvision(const YamlCursor& root) {
  if (Status status = check_lens(root); !status) return tl::unexpected(status.error());
  const auto resolution = root.at("resolution");
  if (!resolution) return tl::unexpected(resolution.error());
  const auto width = resolution->read_at("width", side_of);
  if (!width) return tl::unexpected(width.error());
  const auto height = resolution->read_at("height", side_of);
  if (!height) return tl::unexpected(height.error());
  const auto matrix = root.read_at("cameraIntrinsics", [](const YamlCursor& c) { return c.at("data"); });
  if (!matrix) return tl::unexpected(matrix.error());
  const auto k = matrix->exactly_numbers(9);
  if (!k) return tl::unexpected(k.error());
  const auto coefficients = distortion_of(root);
  if (!coefficients) return tl::unexpected(coefficients.error());
  const auto data = coefficients->at("data");
  if (!data) return tl::unexpected(data.error());
  const auto d = data->numbers();
  if (!d) return tl::unexpected(d.error());
  const YamlNode model{.kind = YamlNode::Kind::Scalar,
                       .line = data->place().line.value_or(1),
                       .text = d->size() > 5 ? "rational_polynomial" : "plumb_bob"};
  auto camera = make_camera(YamlCursor(model, root.source(), data->place().key), intrinsics_of(*k), *d,
                            *width, *height, {*matrix, *resolution, *data, {}});
  if (!camera) return tl::unexpected(camera.error());
  return NamedCamera{.name = "photonvision", .camera = *std::move(camera)};
}

}  // namespace waymark::internal

namespace waymark {
namespace {

using nlohmann::ordered_json;

ordered_json matrix(int rows, std::size_t cols, const std::vector<double>& data) {
  constexpr int kDouble = 6;  // CV_64F
  return {{"rows", rows}, {"cols", cols}, {"type", kDouble}, {"data", data}};
}

ordered_json point(const Eigen::Vector2d& p) { return {{"x", p.x()}, {"y", p.y()}}; }
ordered_json point(const Eigen::Vector3d& p) { return {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}; }

/// An observation in PhotonVision's format, which has pixel centres at integers.
ordered_json to_json(const CameraObservation& seen) {
  ordered_json places = ordered_json::array();
  ordered_json pixels = ordered_json::array();
  ordered_json errors = ordered_json::array();
  for (std::size_t i = 0; i < seen.seen_px.size(); ++i) {
    places.push_back(point(seen.target_points_m[i]));
    pixels.push_back(point(Eigen::Vector2d(seen.seen_px[i].array() - 0.5)));
    errors.push_back(point(seen.errors_px[i]));  // non-finite values become null
  }
  const Eigen::Quaterniond q = seen.cam_T_target.rotation().quaternion();
  return {{"locationInObjectSpace", places},
          {"locationInImageSpace", pixels},
          {"reprojectionErrors", errors},
          {"optimisedCameraToObject",
           {{"translation", point(seen.cam_T_target.translation())},
            {"rotation", {{"quaternion", {{"W", q.w()}, {"X", q.x()}, {"Y", q.y()}, {"Z", q.z()}}}}}}},
          {"cornersUsed", seen.used},
          {"snapshotName", seen.image}};
}

}  // namespace

Result<std::string> to_photonvision_json(const NamedCamera& named,
                                         const std::vector<CameraObservation>& observations) {
  const auto* radtan = std::get_if<PinholeRadtan>(&named.camera.projection());
  if (radtan == nullptr)
    return fail(ErrorCode::Unsupported, "PhotonVision does not support the equidistant lens", {},
                "Write opencv, ros or kalibr instead, or calibrate with `lens=rational8`.");
  std::vector<double> d = internal::file_distortion(named.camera);
  if (d.empty()) d.assign(5, 0.0);
  ordered_json json = {
      {"resolution", {{"width", named.camera.width_px()}, {"height", named.camera.height_px()}}},
      {"cameraIntrinsics",
       matrix(3, 3, {radtan->fx, radtan->skew, radtan->cx - 0.5, 0, radtan->fy, radtan->cy - 0.5, 0, 0, 1})},
      {"distCoeffs", matrix(1, d.size(), d)},
      {"calobjectWarp", ordered_json::array()},
      {"observations", ordered_json::array()},
      {"lensmodel", d.size() > 5 ? "LENSMODEL_OPENCV8" : "LENSMODEL_OPENCV"}};
  for (const CameraObservation& seen : observations) json["observations"].push_back(to_json(seen));
  return json.dump() + "\n";
}

}  // namespace waymark
