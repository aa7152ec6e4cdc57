#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// The part of the full image that a camera sends: a region of interest, then binning, as in
/// sensor_msgs/CameraInfo. All zeros mean the whole image without binning.
struct ImagePart {
  std::int64_t x_px = 0, y_px = 0;            ///< first column and row in the full image
  std::int64_t width_px = 0, height_px = 0;   ///< size in the full image; 0 means up to its end
  std::int64_t binning_x = 0, binning_y = 0;  ///< pixels of the full image per sent pixel; 0 means 1
};

/// A calibration as stored in files and messages, before any check. All readers fill in this struct and call
/// camera_from(), so that the same rules apply to all formats.
struct CalibrationNumbers {
  /// As written: "plumb_bob", "radtan", "Kannala-Brandt", …; if empty, the radial-tangential model.
  std::string model{};
  std::array<double, 9> k{};  ///< camera matrix of the full image, row by row; pixel centres at integers
  std::vector<double> distortion{};  ///< in OpenCV's order
  std::int64_t width_px = 0;         ///< size of the full image
  std::int64_t height_px = 0;
  ImagePart part{};
};

/// Names of the distortion models that camera_from() accepts, for messages. Case, spaces, '-' and '_' are
/// ignored.
[[nodiscard]] std::vector<std::string> distortion_model_names();

/// The camera for the images that are sent. The number of coefficients selects the form of the
/// radial-tangential model, as in OpenCV: 0, 4, 5 or 8. Of 12 or 14 coefficients, those beyond the eighth
/// (thin prism, tilted sensor) must be zero. The equidistant model has 4 coefficients, or none.
///
/// Fails on an unknown model (key "distortion_model"), on a number of coefficients that the model does not
/// have, and on coefficients that are not supported (key "distortion"). Also fails if the matrix is not a
/// camera matrix (key "camera_matrix") or the part is not inside the image (key "roi"), and in the same cases
/// as CameraModel::make().
[[nodiscard]] Result<CameraModel> camera_from(const CalibrationNumbers& numbers);

}  // namespace waymark
