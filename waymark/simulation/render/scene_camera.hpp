#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/simulation/render/scene.hpp"

/// Pictures of a scene as a moving camera takes them, with the truth about each.
///
///     const auto camera = SceneCamera::make(scene_of(world), model, options);
///     const auto frame = camera->render([&](double t) { return map_T_cam_at(stamp + t); }, stamp, seed);
///
/// A driver that has threads renders bands side by side: begin() once, expose() each band, and when all are
/// exposed read_out() each, then finish(). The bytes are those of render().
namespace waymark {

/// Every knob of a camera that sees a scene. docs/concepts/camera_simulation.md shows each of them.
struct SceneCameraOptions {
  double exposure_ms = 10;
  double readout_ms = 0;
  double blur_step_px = 0.5;
  double lens_sigma_px = 0.5;
  double aperture_mm = 0;
  double focus_distance_m = 2;
  double vignetting_power = 0;
  double white_level_dn = 190;
  double full_well_electrons = 12000;
  double read_noise_electrons = 12;
  double gamma = 1;
  double ambient = 0.75;
  double flicker = 0;
  double flicker_hz = 100;
  double drift = 0;
  double drift_period_s = 20;
  int jpeg_quality = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.exposure_ms, Field{"exposure_ms", "Exposure time.", 0, 1000});
    visit(self.readout_ms,
          Field{"readout_ms", "Readout time of a rolling shutter, first row to last; 0: global shutter.", 0,
                1000});
    visit(self.blur_step_px,
          Field{"blur_step_px", "Maximum motion of a tag between two samples of the exposure.", 0.05, 10});
    visit(
        self.lens_sigma_px,
        Field{"lens_sigma_px",
              "Standard deviation of the blur of the lens, on top of the integration over the pixel.", 0, 5});
    visit(self.aperture_mm,
          Field{"aperture_mm", "Diameter of the entrance pupil; 0: pinhole, no defocus.", 0, 100});
    visit(self.focus_distance_m, Field{"focus_distance_m", "Distance of sharp focus.", 0.01, 1e6});
    visit(self.vignetting_power,
          Field{"vignetting_power",
                "Vignetting: exponent of the cosine of the angle from the axis; 4 is natural.", 0, 20});
    visit(self.white_level_dn,
          Field{"white_level_dn", "Grey level of white paper in nominal light, before gamma.", 1, 1000});
    visit(self.full_well_electrons,
          Field{"full_well_electrons",
                "Electrons at grey level 255, which set the shot noise; 0: no shot noise.", 0, 1e9});
    visit(self.read_noise_electrons,
          Field{"read_noise_electrons", "Standard deviation of the read noise, in electrons.", 0, 1e6});
    visit(self.gamma,
          Field{"gamma",
                "Gamma of the picture: output is input to the power of 1 / gamma; 2.2 is usual for displays.",
                0.2, 5});
    visit(self.ambient,
          Field{"ambient", "Share of ambient light; the rest comes from the lamp (Lambertian).", 0, 1});
    visit(self.flicker,
          Field{"flicker", "Relative amplitude of the flicker of lamps at mains frequency.", 0, 1});
    visit(self.flicker_hz,
          Field{"flicker_hz", "Frequency of the flicker: twice that of the mains.", 1, 100000});
    visit(self.drift, Field{"drift", "Relative amplitude of the illumination drift.", 0, 1});
    visit(self.drift_period_s, Field{"drift_period_s", "Period of the illumination drift.", 0.01, 1e6});
    visit(self.jpeg_quality,
          Field{"jpeg_quality", "JPEG quality with which the driver encodes a picture; 0: not encoded.", 0,
                100});
  }
};

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
