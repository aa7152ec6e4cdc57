#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "waymark/config/exchange/camera_file.hpp"

namespace waymark::testing {

inline const char* const kCameraInfo = R"(image_width: 640
image_height: 480
camera_name: dabai
camera_matrix:
  rows: 3
  cols: 3
  data: [442.17, 0.000000, 323.0, 0.0, 443.88, 246.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.045, -0.077, 0.001, -0.002, 0.0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [445.0, 0, 322.1, 0, 0, 446.2, 246.9, 0, 0, 0, 1, 0]
)";

inline const char* const kCamchain = R"(cam0:
  T_cam_imu:
  - [0.0, -1.0, 0.0, 0.01]
  - [1.0, 0.0, 0.0, -0.02]
  - [0.0, 0.0, 1.0, 0.03]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.01, 0.02, -0.003, 0.0004]
  distortion_model: equidistant
  intrinsics: [286.7, 286.8, 420.9, 396.9]
  resolution: [848, 800]
  rostopic: /t265/fisheye1/image_raw
  timeshift_cam_imu: -0.0025
cam1:
  T_cn_cnm1: [[1, 0, 0, -0.064], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
  camera_model: pinhole
  distortion_coeffs: [-0.2, 0.1, 0.001, 0.002]
  distortion_model: radtan
  intrinsics: [500.0, 501.0, 319.5, 239.5]
  resolution: [640, 480]
)";

/// The text with its one `from` exchanged for `to`.
inline std::string exchanged(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

inline std::string camera_error(const std::string& text, std::string_view name = {}) {
  const auto camera = parse_camera(text, "c.yaml", name);
  return camera ? "" : to_string(camera.error());
}

}  // namespace waymark::testing
