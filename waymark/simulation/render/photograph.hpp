#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/families/family.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"

/// Still photographs of flat tags and printed sheets, with exact ground truth.
namespace waymark {

/// A printed tag in front of the camera. Cells outside the tag (in the corners of circular families) show
/// paper.
struct TagInScene {
  TagId tag;
  SE3 cam_T_tag;            ///< tag frame: origin at the centre, x right, y down, z into the tag
  double size_m = 0;        ///< side length of the square where the black border meets the white one
  double margin_cells = 1;  ///< white paper around the total width of the tag, in tag cells
};

/// A printed sheet in front of the camera.
struct SheetInScene {
  Image raster;                 ///< from 0 (ink) to 255 (paper)
  double metres_per_pixel = 0;  ///< pixel size of the raster, e.g. 0.0254 / 300
  SE3 cam_T_sheet;  ///< sheet frame: origin at the centre of the raster, x right, y down, z into the sheet
};

/// The objects in front of the camera. Nearer objects (by the distance of their centres) cover farther ones;
/// intersecting objects are not handled correctly.
struct PhotographScene {
  std::vector<TagInScene> tags;
  std::vector<SheetInScene> sheets;
};

/// Camera and illumination settings of a photograph. Levels are grey levels in the image (DN, 0 to 255).
struct PhotographOptions {
  double blur_sigma_px = 0.6;
  double black_level_dn = 40;
  double white_level_dn = 200;
  double read_noise_dn = 1.0;
  double shot_noise_dn = 0.02;
  std::string background = "clutter";
  double background_level_dn = 110;
  double background_contrast_dn = 60;
  double clutter_size_px = 48;
  double illumination_gradient = 0.2;
  double illumination_direction_deg = 30;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.blur_sigma_px, Field{"blur_sigma_px",
                                    "Standard deviation of the Gaussian blur of the lens, in addition to the "
                                    "integration over the pixel; below 0.05: none.",
                                    0, 50});
    visit(self.black_level_dn,
          Field{"black_level_dn", "Grey level of black ink in mean illumination.", 0, 255});
    visit(self.white_level_dn,
          Field{"white_level_dn", "Grey level of white paper in mean illumination.", 0, 255});
    visit(self.read_noise_dn,
          Field{"read_noise_dn", "Standard deviation of the read noise, in grey levels.", 0, 100});
    visit(self.shot_noise_dn,
          Field{"shot_noise_dn",
                "Shot noise per grey level: variance = read_noise_dn^2 + shot_noise_dn * level.", 0, 100});
    visit(self.background, Field{"background", "Background behind the tags: flat, gradient or clutter."});
    visit(self.background_level_dn,
          Field{"background_level_dn", "Mean grey level of the background.", 0, 255});
    visit(self.background_contrast_dn,
          Field{"background_contrast_dn", "Largest difference of the background from its mean.", 0, 255});
    visit(self.clutter_size_px,
          Field{"clutter_size_px", "Size of the largest blobs of a cluttered background.", 1, 10000});
    visit(self.illumination_gradient,
          Field{"illumination_gradient",
                "Relative difference in brightness between the two ends of the image diagonal.", 0, 1.9});
    visit(self.illumination_direction_deg,
          Field{"illumination_direction_deg",
                "Direction in which the illumination increases: 0 right, 90 down.", -360, 360});
  }
};

/// Ground truth for one tag in a photograph.
struct TagTruth {
  TagId tag;
  SE3 cam_T_tag;
  double size_m = 0;
  /// TL, TR, BR, BL of the printed tag, in distorted pixels with pixel centres at +1/2; they may lie outside
  /// the image.
  std::array<Eigen::Vector2d, 4> corners_px{};
  double size_px = 0;  ///< side length the tag would have if it faced the camera at its position
  double tilt_rad =
      0;  ///< angle between the line of sight and the tag's normal; 0 if frontal, above pi/2 if facing away
  /// Fraction of the size x size square that is inside the image and not covered by nearer objects, sampled
  /// at 33 x 33 points including the edges. It is 1 if the tag is entirely visible, and 0 if it faces away or
  /// is out of view.
  double visible_fraction = 0;
};

struct Photograph {
  Image image;
  std::vector<TagTruth> tags = {};  ///< in scene order; without tags whose corners do not all project
};

/// Renders the image. Each pixel is the exact average of the scene over its square (see Coverage), blurred by
/// the lens; then illumination, noise and rounding are applied. The same scene, options and seed give the
/// same image. Backgrounds are out of focus, that is, constant within the reach of the lens blur. Errors:
/// InvalidArgument (an invalid option, size or tag number, an empty raster, a non-finite pose), LimitExceeded
/// (more than 250 million pixels). The time is proportional to the number of pixels around tags and sheets.
[[nodiscard]] Result<Photograph> photograph(const CameraModel& camera, const PhotographScene& scene,
                                            const PhotographOptions& options, Random& random);

}  // namespace waymark
