#pragma once

#include <memory>

#include "waymark/drivers/simulated/simulated_robot.hpp"
#include "waymark/simulation/scene_camera.hpp"
#include "waymark/tags/apriltag_detector.hpp"
#include "waymark/tags/refinement.hpp"

namespace waymark {

/// How pictures are made and looked at.
struct SceneEyeOptions {
  SceneOptions scene{};
  SceneCameraOptions camera{};
  DetectorOptions detector{};
  bool refine_corners = true;
  RefinementOptions refinement{};
};

/// A picture, what is true of it, and what the detector found in it.
struct SeenPicture {
  RenderedFrame picture{};
  TagFrame found{};
};

/// A camera with a detector behind it. Not safe to use from several threads: each has its own.
class SceneEye {
 public:
  [[nodiscard]] static Result<std::unique_ptr<SceneEye>> make(std::shared_ptr<const World> world,
                                                              const CameraModel& camera,
                                                              const SE3& base_T_cam,
                                                              const SceneEyeOptions& options);

  /// Another one with a detector of its own; what the camera knows of its lens and of the scene is shared.
  [[nodiscard]] Result<std::unique_ptr<SceneEye>> another() const;

  /// Takes the picture. The same shot gives the same bytes, whatever was seen before.
  [[nodiscard]] Result<RenderedFrame> take(const CameraShot& shot);
  /// Takes the picture and looks for tags. The same shot gives the same bytes, whatever was seen before.
  [[nodiscard]] Result<SeenPicture> look(const CameraShot& shot);
  [[nodiscard]] const Detector& detector() const { return *detector_; }

 private:
  SceneEye(SceneCamera camera, std::unique_ptr<Detector> detector, const SE3& base_T_cam,
           const SceneEyeOptions& options, std::shared_ptr<const World> world);
  [[nodiscard]] Status face(const std::shared_ptr<const World>& world);
  [[nodiscard]] Status through_jpeg(Image& image) const;

  SceneCamera camera_;
  std::unique_ptr<Detector> detector_;
  SE3 base_T_cam_;
  SceneEyeOptions options_;
  std::shared_ptr<const World> world_;
};

}  // namespace waymark
