#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/simulation/scene.hpp"
#include "waymark/simulation/scene_camera_options.hpp"

/// Pictures of a scene as a moving camera takes them, with the truth about each.
///
///     const auto camera = SceneCamera::make(scene_of(world), model, options);
///     const auto frame = camera->render([&](double t) { return map_T_cam_at(stamp + t); }, stamp, seed);
///
/// A driver that has threads renders bands side by side: begin() once, expose() each band, and when all are
/// exposed read_out() each, then finish(). The bytes are those of render().
namespace waymark {

/// map_T_cam so many seconds after the stamp (before it: negative), while the picture is taken: within half
/// of exposure_ms + readout_ms.
using CameraMotion = std::function<SE3(double seconds)>;

/// What is true of a tag in a picture.
struct SceneTagTruth {
  TagId tag{};
  double size_m = 0;
  SE3 cam_T_tag{};  ///< in the middle of the exposure
  /// TL TR BR BL [px], distorted, centres at +1/2, where the middle of the exposure of their row shows them;
  /// they may lie outside the picture.
  std::array<Eigen::Vector2d, 4> corners_px{};
  std::array<bool, 4> corner_visible{};  ///< in the picture, and nothing before it
  double visible_fraction = 0;           ///< of 17 x 17 points of the tag
  double blur_px = 0;                    ///< way of its centre while the shutter is open
};

/// A picture and the truth about it.
struct RenderedFrame {
  SensorTime stamp{};  ///< middle of the exposure of the middle row
  Image image{};
  SE3 map_T_cam{};                       ///< then
  std::vector<SceneTagTruth> tags = {};  ///< those of which a part is visible, in the scene's order
};

/// A picture being taken. Only SceneCamera looks inside.
struct SceneExposure;

class SceneCamera {
 public:
  /// O(pixels): a line of sight for each. Fails on an option out of range, a scene that cannot be (see
  /// check()), and more than 100 million pixels.
  [[nodiscard]] static Result<SceneCamera> make(Scene scene, const CameraModel& model,
                                                const SceneCameraOptions& options);

  /// Takes a picture. The same camera, motion, stamp and seed give the same bytes. Fails on a motion with a
  /// number that is not finite.
  [[nodiscard]] Result<RenderedFrame> render(const CameraMotion& motion, SensorTime stamp,
                                             std::uint64_t seed) const;

  /// The same, taken apart. Calls `motion`; nothing after does. Bands are told apart by number, 0 to bands()
  /// - 1, and touch nothing in common.
  [[nodiscard]] Result<std::shared_ptr<SceneExposure>> begin(const CameraMotion& motion, SensorTime stamp,
                                                             std::uint64_t seed) const;
  [[nodiscard]] int bands() const;
  void expose(SceneExposure& exposure, int band) const;
  /// Once all bands are exposed: the lens spreads light beyond them.
  void read_out(SceneExposure& exposure, int band) const;
  [[nodiscard]] RenderedFrame finish(SceneExposure& exposure) const;

  /// The world has changed (a tag was moved).
  [[nodiscard]] Status set_scene(Scene scene);

  [[nodiscard]] const CameraModel& model() const;
  [[nodiscard]] const SceneCameraOptions& options() const;

  /// What the camera is made of; shared between copies.
  struct Parts;

 private:
  explicit SceneCamera(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}
  std::shared_ptr<const Parts> parts_;
};

}  // namespace waymark
