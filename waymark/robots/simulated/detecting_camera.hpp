#pragma once

#include <memory>
#include <vector>

#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// Options for rendering and detection.
struct DetectingCameraOptions {
  SceneOptions scene{};
  SceneCameraOptions camera{};
  DetectorOptions detector{};
  bool refine_corners = true;
  RefinementOptions refinement{};
};

/// An image with its ground truth and detections.
struct SeenImage {
  RenderedFrame frame{};
  TagFrame found{};
};

/// The cameras of a robot, with a detector. Not thread-safe; use another() to create one for each thread.
class DetectingCamera {
 public:
  [[nodiscard]] static Result<std::unique_ptr<DetectingCamera>> make(
      std::shared_ptr<const World> world, const std::vector<MountedCamera>& cameras,
      const DetectingCameraOptions& options);

  /// A copy with its own detector that shares lens tables and scene with this one.
  [[nodiscard]] Result<std::unique_ptr<DetectingCamera>> another() const;

  /// Renders the image. The same shot always gives the same bytes, regardless of earlier calls.
  [[nodiscard]] Result<RenderedFrame> take(const CameraShot& shot);
  /// Renders the image and detects tags. The same shot always gives the same result, regardless of earlier
  /// calls.
  [[nodiscard]] Result<SeenImage> detect(const CameraShot& shot);
  [[nodiscard]] const TagFinder& finder() const { return finder_; }

 private:
  struct MountedSceneCamera {
    MountedCamera mounted;
    SceneCamera camera;
  };
  DetectingCamera(std::vector<MountedSceneCamera> cameras, TagFinder finder,
                  const DetectingCameraOptions& options, std::shared_ptr<const World> world);
  [[nodiscard]] Status set_world(const std::shared_ptr<const World>& world);
  [[nodiscard]] Status through_jpeg(Image& image) const;

  std::vector<MountedSceneCamera> cameras_;
  TagFinder finder_;
  DetectingCameraOptions options_;
  std::shared_ptr<const World> world_;
};

}  // namespace waymark
