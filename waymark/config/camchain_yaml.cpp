// kalibr camchain: https://github.com/ethz-asl/kalibr/wiki/yaml-formats. TagSLAM reads and writes the same
// with keys of its own.
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/base/message_text.hpp"
#include "waymark/config/camera_formats.hpp"
#include "waymark/config/yaml_write.hpp"

namespace waymark {
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
      // TagSLAM's own
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

/// Four rows of four numbers that are a rotation and a translation.
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
  constexpr double kTolerance = 1e-3;  // matrices typed with three or four digits are meant well
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool rotates = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
                       R.col(0).dot(R.col(1).cross(R.col(2))) > 0.0;
  if (!rotates || T.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return cursor->fail_here(ErrorCode::InvalidArgument, "not a rotation and a translation",
                             "Its rows are [R t] with a rotation R, and [0, 0, 0, 1].");
  }
  return std::optional<Eigen::Matrix4d>(T);
}

/// What a camera may have besides its intrinsics.
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
  const FileIntrinsics k{(*numbers)[0], (*numbers)[1], (*numbers)[2], (*numbers)[3]};
  const CameraPlaces places{entry.find("intrinsics").value_or(entry),
                            entry.find("resolution").value_or(entry), coefficients.value_or(*model)};
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
                  fmt::format("a camchain cannot hold the rational model of camera '{}'", named.name), {},
                  "Write it as camera_info YAML.");
    }
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

}  // namespace waymark
