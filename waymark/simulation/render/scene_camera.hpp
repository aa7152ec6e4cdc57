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

/// Images of a scene taken by a moving camera, with ground truth.
///
///     const auto camera = SceneCamera::make(scene_of(world), model, options);
///     const auto frame = camera->render([&](double t) { return map_T_cam_at(stamp + t); }, stamp, seed);
///
/// A multi-threaded caller can render bands in parallel: call begin() once, expose() for each band and, when
/// all are exposed, read_out() for each band, then finish(). The bytes are the same as from render().
namespace waymark {

/// All parameters of a camera that renders a scene. Each of them is illustrated in
/// docs/concepts/camera_simulation.md.
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
    visit(self.lens_sigma_px,
          Field{"lens_sigma_px",
                "Standard deviation of the blur of the lens, in addition to the integration over the pixel.",
                0, 5});
    visit(self.aperture_mm,
          Field{"aperture_mm", "Diameter of the entrance pupil; 0: pinhole, no defocus.", 0, 100});
    visit(self.focus_distance_m, Field{"focus_distance_m", "Distance of sharp focus.", 0.01, 1e6});
    visit(self.vignetting_power,
          Field{"vignetting_power",
                "Vignetting: exponent of the cosine of the angle from the axis; 4 is natural.", 0, 20});
    visit(
        self.white_level_dn,
        Field{"white_level_dn", "Grey level of white paper in nominal illumination, before gamma.", 1, 1000});
    visit(self.full_well_electrons,
          Field{"full_well_electrons",
                "Electrons at grey level 255, which set the shot noise; 0: no shot noise.", 0, 1e9});
    visit(self.read_noise_electrons,
          Field{"read_noise_electrons", "Standard deviation of the read noise, in electrons.", 0, 1e6});
    visit(self.gamma,
          Field{"gamma",
                "Gamma of the image: output is input to the power of 1 / gamma; 2.2 is usual for displays.",
                0.2, 5});
    visit(self.ambient,
          Field{"ambient", "Fraction of ambient illumination; the rest comes from the lamp (Lambertian).", 0,
                1});
    visit(self.flicker,
          Field{"flicker", "Relative amplitude of the flicker of lamps at mains frequency.", 0, 1});
    visit(self.flicker_hz,
          Field{"flicker_hz", "Frequency of the flicker: twice that of the mains.", 1, 100000});
    visit(self.drift, Field{"drift", "Relative amplitude of the illumination drift.", 0, 1});
    visit(self.drift_period_s, Field{"drift_period_s", "Period of the illumination drift.", 0.01, 1e6});
    visit(self.jpeg_quality,
          Field{"jpeg_quality", "JPEG quality with which the driver encodes an image; 0: not encoded.", 0,
                100});
  }
};

/// map_T_cam at a time in seconds after the stamp (negative if before it), during the exposure, that is,
/// within half of exposure_ms + readout_ms.
using CameraMotion = std::function<SE3(double seconds)>;

/// Ground truth for one tag in an image.
struct SceneTagTruth {
  TagId tag{};
  double size_m = 0;
  SE3 cam_T_tag{};  ///< in the middle of the exposure
  /// TL, TR, BR, BL [px], distorted, with pixel centres at +1/2, each at the middle of the exposure of its
  /// row; they may lie outside the image.
  std::array<Eigen::Vector2d, 4> corners_px{};
  std::array<bool, 4> corner_visible{};  ///< whether each corner is in the image and not occluded
  double visible_fraction = 0;           ///< fraction of 17 x 17 points on the tag that are visible
  double blur_px = 0;                    ///< path length of the tag centre during the exposure
};

/// An image and its ground truth.
struct RenderedFrame {
  SensorTime stamp{};  ///< middle of the exposure of the middle row
  Image image{};
  SE3 map_T_cam{};                       ///< pose at the stamp
  std::vector<SceneTagTruth> tags = {};  ///< the tags that are at least partly visible, in scene order
};

/// An image being rendered. Only SceneCamera accesses its members.
struct SceneExposure;

class SceneCamera {
 public:
  /// O(pixels), for one line of sight per pixel. Fails if an option is out of range, the scene is invalid
  /// (see check()), or there are more than 100 million pixels.
  [[nodiscard]] static Result<SceneCamera> make(Scene scene, const CameraModel& model,
                                                const SceneCameraOptions& options);

  /// Renders an image. The same camera, motion, stamp and seed always give the same bytes. Fails if the
  /// motion contains non-finite values.
  [[nodiscard]] Result<RenderedFrame> render(const CameraMotion& motion, SensorTime stamp,
                                             std::uint64_t seed) const;

  /// The same, divided into steps. Only begin() calls `motion`. Bands are numbered from 0 to bands() - 1 and
  /// share no data.
  [[nodiscard]] Result<std::shared_ptr<SceneExposure>> begin(const CameraMotion& motion, SensorTime stamp,
                                                             std::uint64_t seed) const;
  [[nodiscard]] int bands() const;
  void expose(SceneExposure& exposure, int band) const;
  /// To be called once all bands are exposed, because the lens blur crosses bands.
  void read_out(SceneExposure& exposure, int band) const;
  [[nodiscard]] RenderedFrame finish(SceneExposure& exposure) const;

  /// Updates the scene after a change in the world, for example a tag that was moved.
  [[nodiscard]] Status set_scene(Scene scene);

  [[nodiscard]] const CameraModel& model() const;
  [[nodiscard]] const SceneCameraOptions& options() const;

  /// Data of the camera that are shared between copies.
  struct Parts;

 private:
  explicit SceneCamera(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}
  std::shared_ptr<const Parts> parts_;
};

}  // namespace waymark
