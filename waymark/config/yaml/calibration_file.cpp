#include "waymark/config/yaml/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <system_error>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/exchange/camera_formats.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr YamlLimits kCalibrationLimits{.bytes = std::size_t{1} << 18U, .nodes = 20'000, .depth = 16};
constexpr const char* kCalibrationFormat = "waymark-calibration-1";
constexpr internal::EntryCount kValueCount{.key = "value_count", .entries = "values"};
constexpr const char* kEnteredByHand = "readout_s";  // not counted, so that it may be added to a file
constexpr const char* kKnown = "known";
constexpr const char* kUnobservable = "unobservable";

Status read_value(const YamlCursor& entry, const std::string& name, Calibration& calibration) {
  if (Status status = entry.check_keys({"value", "sigma", "verdict", "advice"}); !status) return status;
  internal::Numbers number(entry);
  CalibratedValue value{.value = number("value"), .sigma = number("sigma")};
  if (!number.status()) return number.status();
  if (value.sigma < 0)
    return entry.at("sigma")->fail_here(ErrorCode::InvalidArgument,
                                        "a standard deviation must not be negative");
  const Result<std::string> verdict = entry.read_at("verdict", &YamlCursor::text);
  if (!verdict) return tl::unexpected(verdict.error());
  if (*verdict != kKnown && *verdict != kUnobservable)
    return entry.at("verdict")->fail_here(ErrorCode::InvalidArgument,
                                          fmt::format("unknown verdict '{}'", *verdict),
                                          suggestion(*verdict, {kKnown, kUnobservable}));
  if (*verdict == kUnobservable) value.verdict = CalibrationVerdict::Unobservable;
  if (const auto advice = entry.find("advice")) {
    const Result<std::string> words = advice->text();
    if (!words) return tl::unexpected(words.error());
    value.advice = *words;
  }
  calibration.values[name] = value;
  return {};
}

Status read_values(const YamlCursor& root, Calibration& calibration) {
  const auto entry = root.find("values");
  if (!entry) return {};
  if (Status status = entry->check_keys(calibration_names()); !status) return status;
  for (const std::string& name : calibration_names()) {
    const auto value = entry->find(name);
    if (!value) continue;
    if (Status status = read_value(*value, name, calibration); !status) return status;
  }
  return {};
}

constexpr const char* kCorrelations = "camera_correlations";

/// "fx_px" for "fx", but "k1" for "k1".
std::string value_name(const std::string& parameter) {
  return parameter.starts_with('f') || parameter.starts_with('c') ? parameter + "_px" : parameter;
}

std::vector<std::string> value_names(const CameraModel& camera) {
  std::vector<std::string> names = intrinsics_names(camera);
  for (std::string& name : names) name = value_name(name);
  return names;
}

/// Reads the row of a parameter: its correlations with the parameters before it.
Status read_row(const YamlCursor& row, Eigen::Index i, Eigen::MatrixXd& R) {
  const auto numbers = row.exactly_numbers(static_cast<std::size_t>(i));
  if (!numbers) return tl::unexpected(numbers.error());
  for (Eigen::Index j = 0; j < i; ++j) {
    const double r = (*numbers)[static_cast<std::size_t>(j)];
    if (std::abs(r) > 1)
      return row.fail_here(ErrorCode::InvalidArgument, fmt::format("{} is not a correlation", r),
                           "A correlation is between -1 and 1.");
    R(i, j) = R(j, i) = r;
  }
  return {};
}

Status read_correlations(const YamlCursor& root, Calibration& calibration) {
  const auto entry = root.find(kCorrelations);
  if (!entry) return {};
  if (!calibration.camera)
    return entry->fail_here(ErrorCode::InvalidArgument,
                            "correlations of a camera that the file does not contain",
                            "Add `camera_info`, or remove this key.");
  const std::vector<std::string> names = value_names(*calibration.camera);
  if (Status status = entry->check_keys({names.begin() + 1, names.end()}); !status) return status;
  const auto n = std::ssize(names);
  Eigen::MatrixXd R = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = names[static_cast<std::size_t>(i)];
    const auto value = calibration.values.find(name);
    if (value == calibration.values.end() || !(value->second.sigma > 0))
      return entry->fail_here(ErrorCode::InvalidArgument,
                              fmt::format("correlations without a standard deviation of {}", name),
                              fmt::format("Add `values.{}` with a sigma above 0, or remove this key.", name));
    if (i == 0) continue;
    const Result<YamlCursor> row = entry->at(name);
    if (!row) return tl::unexpected(row.error());
    if (Status status = read_row(*row, i, R); !status) return status;
  }
  if (!is_covariance(R))
    return entry->fail_here(ErrorCode::InvalidArgument, "no parameters can have these correlations together",
                            "The matrix must be positive semidefinite. Calibrate again, or remove this key.");
  calibration.camera_correlations = std::move(R);
  return {};
}

std::string correlations_yaml(const CameraModel& camera, const Eigen::MatrixXd& R) {
  const std::vector<std::string> names = value_names(camera);
  std::string text = fmt::format("{}:\n", kCorrelations);
  for (Eigen::Index i = 1; i < R.rows(); ++i) {
    const Eigen::VectorXd row = R.row(i).head(i);
    text += fmt::format("  {}: {}\n", names[static_cast<std::size_t>(i)],
                        yaml_list({row.data(), static_cast<std::size_t>(i)}));
  }
  return text;
}

Status check_calibration_format(const YamlCursor& root) {
  const Result<std::string> format = root.read_at("format", &YamlCursor::text);
  if (!format)
    return root.fail_here(
        ErrorCode::Unreadable, "not a Waymark calibration",
        fmt::format("A calibration begins with `format: {}`; write one with `waymark calibrate`.",
                    kCalibrationFormat));
  if (*format != kCalibrationFormat)
    return root.at("format")->fail_here(ErrorCode::Unsupported,
                                        fmt::format("unsupported calibration format '{}'", *format),
                                        fmt::format("Known: {}.", kCalibrationFormat));
  if (Status status = root.check_keys(
          {"format", kValueCount.key, "provenance", "camera_info", "values", kCorrelations, "end"});
      !status)
    return status;
  const auto values = root.find("values");
  const std::size_t all = values ? values->children().size() : 0;
  return internal::check_end(root, kValueCount, values && values->find(kEnteredByHand) ? all - 1 : all);
}

std::string indented_block(const std::string& text) {
  std::string block;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    block += "  " + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return block;
}

}  // namespace

const std::vector<std::string>& calibration_names() {
  static const std::vector<std::string> names = {"fx_px",
                                                 "fy_px",
                                                 "cx_px",
                                                 "cy_px",
                                                 "k1",
                                                 "k2",
                                                 "p1",
                                                 "p2",
                                                 "k3",
                                                 "k4",
                                                 "k5",
                                                 "k6",
                                                 "corner_sigma_px",
                                                 "mounting_x_m",
                                                 "mounting_y_m",
                                                 "mounting_z_m",
                                                 "mounting_roll_rad",
                                                 "mounting_pitch_rad",
                                                 "mounting_yaw_rad",
                                                 "odometry_scale",
                                                 "yaw_scale",
                                                 "yaw_noise_rad_sqrt_m",
                                                 "gyro_gain",
                                                 "gyro_bias_rad_s",
                                                 "side_slip_s",
                                                 "camera_latency_s",
                                                 "turn_lead_s",
                                                 "odometry_yaw_bias_rad_s",
                                                 "sight_scale",
                                                 "focal_scale",
                                                 "readout_s"};
  return names;
}

Result<Calibration> parse_calibration(std::string_view text, const std::string& source) {
  const Result<YamlNode> tree = parse_yaml(text, source, kCalibrationLimits);
  if (!tree) return tl::unexpected(tree.error());
  const YamlCursor root(*tree, source);
  if (Status status = check_calibration_format(root); !status) return tl::unexpected(status.error());
  Calibration calibration;
  if (const auto camera = root.find("camera_info")) {
    const auto read = internal::read_camera_info(*camera);
    if (!read) return tl::unexpected(read.error());
    calibration.camera = read->camera;
  }
  if (Status status = read_values(root, calibration); !status) return tl::unexpected(status.error());
  if (Status status = read_correlations(root, calibration); !status) return tl::unexpected(status.error());
  auto provenance = internal::read_provenance(root);
  if (!provenance) return tl::unexpected(provenance.error());
  calibration.provenance = std::move(*provenance);
  return calibration;
}

Result<Calibration> read_calibration(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kCalibrationLimits.bytes);
  if (!text) return tl::unexpected(text.error());
  return parse_calibration(*text, path.string());
}

std::string to_yaml(const Calibration& calibration) {
  // Every key but `format` is optional, so the count precedes it.
  constexpr const char* kHead =
      "# Calibration of a robot by waymark calibrate. sigma: standard deviation in the same unit.\n";
  std::string text =
      fmt::format("format: {}\n", kCalibrationFormat) + internal::provenance_yaml(calibration.provenance);
  if (calibration.camera)
    text += "camera_info:\n" +
            indented_block(to_camera_info_yaml({.name = "cam", .camera = *calibration.camera}));
  text += calibration.values.empty() ? "values: {}\n" : "values:\n";
  std::size_t count = 0;
  for (const std::string& name : calibration_names()) {
    const auto found = calibration.values.find(name);
    if (found == calibration.values.end()) continue;
    if (name != kEnteredByHand) ++count;
    const CalibratedValue& v = found->second;
    text += fmt::format("  {}: {{value: {}, sigma: {}, verdict: {}{}}}\n", name, yaml_number(v.value),
                        yaml_number(v.sigma), v.verdict == CalibrationVerdict::Known ? kKnown : kUnobservable,
                        v.advice.empty() ? "" : ", advice: " + yaml_text(v.advice));
  }
  if (calibration.camera && calibration.camera_correlations.size() > 0)
    text += correlations_yaml(*calibration.camera, calibration.camera_correlations);
  return internal::yaml_with_end(kHead, kValueCount, count, text);
}

Status check_calibration_place(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return fail(ErrorCode::Unwritable, "this is a folder", {.source = path.string()},
                "Give the name of a file.");
  if (!std::filesystem::is_regular_file(path, ignored) || read_calibration(path)) return {};
  return fail(ErrorCode::InvalidArgument, "exists and is not a calibration file; not overwritten",
              {.source = path.string()}, "Choose another name, or remove the file.");
}

Status write_calibration(const std::filesystem::path& path, const Calibration& calibration) {
  for (const auto& [name, value] : calibration.values) {
    const bool named = std::ranges::find(calibration_names(), name) != calibration_names().end();
    if (!named || !std::isfinite(value.value) || !std::isfinite(value.sigma))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("{} '{}'; not written", named ? "non-finite number for" : "unknown name", name),
                  {.source = path.string()});
  }
  const Eigen::MatrixXd& R = calibration.camera_correlations;
  const auto parameters = calibration.camera ? std::ssize(intrinsics_names(*calibration.camera)) : 0;
  if (R.size() > 0 && (R.rows() != parameters || R.cols() != parameters || !R.allFinite()))
    return fail(ErrorCode::InvalidArgument,
                "the correlations are not finite or do not belong to this camera; not written",
                {.source = path.string()});
  if (Status status = check_calibration_place(path); !status) return status;
  return write_text_file(path, to_yaml(calibration));
}

Eigen::VectorXd intrinsics_sigma(const CameraModel& camera, const Calibration& calibration) {
  constexpr double kExact = 1e-9;
  const std::vector<std::string> names = value_names(camera);
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(names.size()), kExact);
  bool any = false;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto value = calibration.values.find(names[i]);
    if (value == calibration.values.end() || !(value->second.sigma > 0)) continue;
    sigma[static_cast<Eigen::Index>(i)] = value->second.sigma;
    any = true;
  }
  return any ? sigma : Eigen::VectorXd();
}

IntrinsicsCovariance intrinsics_covariance(const CameraModel& camera, const Calibration& calibration) {
  const Eigen::VectorXd sigma = intrinsics_sigma(camera, calibration);
  if (sigma.size() == 0) return {};
  const Eigen::MatrixXd& R = calibration.camera_correlations;
  if (R.rows() != sigma.size() || R.cols() != sigma.size())
    return IntrinsicsCovariance(sigma.cwiseAbs2().asDiagonal());
  return sigma.asDiagonal() * R * sigma.asDiagonal();
}

SE3 calibrated_mounting(const SE3& base_T_cam, const Calibration& calibration) {
  const CameraMounting mounting = camera_mounting(base_T_cam);
  const auto known = [&](const char* name, double otherwise) {
    return calibration.observable_value(name).value_or(otherwise);
  };
  return base_T_camera({.x_m = known("mounting_x_m", mounting.x_m),
                        .y_m = known("mounting_y_m", mounting.y_m),
                        .z_m = known("mounting_z_m", mounting.z_m),
                        .roll_rad = known("mounting_roll_rad", mounting.roll_rad),
                        .pitch_rad = known("mounting_pitch_rad", mounting.pitch_rad),
                        .yaw_rad = known("mounting_yaw_rad", mounting.yaw_rad)});
}

}  // namespace waymark
