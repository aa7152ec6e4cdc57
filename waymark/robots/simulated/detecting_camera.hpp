#pragma once

#include <memory>
#include <vector>

#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// How pictures are made and looked at.
struct DetectingCameraOptions {
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

/// The cameras of a robot with a detector behind them. Not safe to use from several threads: each has its
/// own.
class DetectingCamera {
 public:
  [[nodiscard]] static Result<std::unique_ptr<DetectingCamera>> make(
      std::shared_ptr<const World> world, const std::vector<MountedCamera>& cameras,
      const DetectingCameraOptions& options);

  /// Another one with a detector of its own; what the cameras know of their lenses and of the scene is
  /// shared.
  [[nodiscard]] Result<std::unique_ptr<DetectingCamera>> another() const;

  /// Takes the picture. The same shot gives the same bytes, whatever was seen before.
  [[nodiscard]] Result<RenderedFrame> take(const CameraShot& shot);
  /// Takes the picture and looks for tags. The same shot gives the same bytes, whatever was seen before.
  [[nodiscard]] Result<SeenPicture> detect(const CameraShot& shot);
  [[nodiscard]] const TagFinder& finder() const { return finder_; }

 private:
  struct MountedSceneCamera {
    MountedCamera mounted;
    SceneCamera camera;
  };
  DetectingCamera(std::vector<MountedSceneCamera> cameras, TagFinder finder,
                  const DetectingCameraOptions& options, std::shared_ptr<const World> world);
  [[nodiscard]] Status face(const std::shared_ptr<const World>& world);
  [[nodiscard]] Status through_jpeg(Image& image) const;

  std::vector<MountedSceneCamera> cameras_;
  TagFinder finder_;
  DetectingCameraOptions options_;
  std::shared_ptr<const World> world_;
};

}  // namespace waymark
