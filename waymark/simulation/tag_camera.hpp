#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/world.hpp"

namespace waymark {

/// A camera and detector in one: corners with noise instead of pictures.
struct TagCameraOptions {
  double corner_sigma_px = 0.1;
  double small_tag_sigma_px = 2.0;
  double miss_probability = 0.02;
  double max_range_m = 4.0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Standard deviation of each corner coordinate of a large tag.", 0, 10});
    visit(self.small_tag_sigma_px,
          Field{"small_tag_sigma_px",
                "Further standard deviation of small tags: this number divided by the side in pixels.", 0,
                100});
    visit(self.miss_probability,
          Field{"miss_probability", "Probability that a visible tag is not detected in a frame.", 0, 1});
    visit(self.max_range_m, Field{"max_range_m", "Maximum distance of a detected tag.", 0});
  }
};

/// What the detector would say of a frame taken from map_T_cam: corners with white noise and the covariance
/// of that noise. A tag of which a part is hidden behind another tag's paper or a panel, or whose middle or a
/// corner is hidden behind a wall or furniture, is not seen; papers and panels hide nothing where
/// World::corners_through_paper says so. O(tags + tags in view * tags).
[[nodiscard]] TagFrame see_tags(const World& world, const CameraModel& camera, const SE3& map_T_cam,
                                SensorTime stamp, const TagCameraOptions& options, Random& random);

}  // namespace waymark
