#pragma once

#include "waymark/camera/camera_model.hpp"

namespace waymark {

/// The lens of an image, as an argument of detection: the camera model for images of its size, or unknown.
/// There is no default and no conversion from a pointer, because corners refined without the model of a
/// distorting lens are biased: a caller without a camera passes unknown().
class ImageLens {
 public:
  /// `camera` must outlive the lens.
  [[nodiscard]] static ImageLens of(const CameraModel& camera) { return ImageLens(&camera); }
  static ImageLens of(const CameraModel&& camera) = delete;
  [[nodiscard]] static ImageLens unknown() { return ImageLens(nullptr); }

  [[nodiscard]] bool known() const { return camera_ != nullptr; }
  /// nullptr if the lens is unknown.
  [[nodiscard]] const CameraModel* camera() const { return camera_; }

 private:
  explicit ImageLens(const CameraModel* camera) : camera_(camera) {}

  const CameraModel* camera_;
};

}  // namespace waymark
