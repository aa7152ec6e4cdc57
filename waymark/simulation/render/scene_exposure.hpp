#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "waymark/simulation/render/ray_table.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/simulation/render/surface.hpp"

namespace waymark {

struct SceneCamera::Parts {
  Scene scene{};
  CameraModel model;
  SceneCameraOptions options{};
  std::shared_ptr<const render::RayTable> rays{};
  std::vector<render::PreparedSurface> surfaces{};  ///< in the order of the scene
  std::vector<float> lens{};                        ///< weights of the lens blur; their number is odd
  std::vector<float> vignetting{};                  ///< factor for each pixel; 0 for pixels without a ray
  std::vector<std::uint8_t> tone{};                 ///< grey level for linear level / kToneSteps
};

struct SceneExposure {
  SensorTime stamp{};
  std::uint64_t seed = 0;
  std::shared_ptr<const SceneCamera::Parts> parts{};  ///< kept even if the scene changes in the meantime
  SE3 map_T_cam{};
  int samples = 1;                            ///< number of times (and lens points) that are averaged
  bool rolling = false;                       ///< whether each row has its own time
  std::vector<SE3> map_T_cams{};              ///< pose at each time or, if rolling, for each row
  std::vector<Eigen::Vector3d> cam_t_lens{};  ///< lens point at each time
  std::vector<const render::PreparedSurface*> order{};  ///< from far to near
  std::vector<SceneTagTruth> tags{};
  std::vector<float> radiance{};  ///< for each pixel; 1 is white paper in nominal illumination
  Image image{};

  [[nodiscard]] const SE3& pose(int row, int sample) const {
    return map_T_cams[render::row_major(rolling ? row : 0, samples, sample)];
  }
};

namespace render {

inline constexpr int kToneSteps = 16;  ///< number of steps per grey level

/// Time from the stamp to the middle of a row's exposure [s].
[[nodiscard]] double row_time_s(const SceneCamera::Parts& parts, double row);

/// Renders the radiance of the pixels in one row of tiles.
void expose_band(SceneExposure& exposure, int band);

/// Converts the radiance in one row of tiles to grey levels, applying lens blur, vignetting, noise, gamma and
/// rounding.
void read_out_band(SceneExposure& exposure, int band);
/// Precomputes the tables for read_out_band().
void prepare_sensor(SceneCamera::Parts& parts);

/// Ground truth for each tag that is at least partly visible.
[[nodiscard]] std::vector<SceneTagTruth> truth_of(const SceneExposure& exposure, const CameraMotion& motion);

}  // namespace render
}  // namespace waymark
