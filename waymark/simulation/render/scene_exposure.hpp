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
  std::vector<render::PreparedSurface> surfaces{};  ///< as in the scene
  std::vector<float> lens{};                        ///< weights of the spread, odd number
  std::vector<float> vignetting{};                  ///< of each pixel; 0 where it sees nothing
  std::vector<std::uint8_t> tone{};                 ///< grey level of linear level / kToneSteps
};

struct SceneExposure {
  SensorTime stamp{};
  std::uint64_t seed = 0;
  std::shared_ptr<const SceneCamera::Parts> parts{};  ///< kept though the scene changes meanwhile
  SE3 map_T_cam{};
  int samples = 1;                                      ///< moments (and points of the lens) summed over
  bool rolling = false;                                 ///< whether rows have their own moments
  std::vector<SE3> map_T_cams{};                        ///< of each moment; if rolling, of each row
  std::vector<Eigen::Vector3d> cam_t_lens{};            ///< point of the lens of each moment
  std::vector<const render::PreparedSurface*> order{};  ///< from far to near
  std::vector<SceneTagTruth> tags{};
  std::vector<float> light{};  ///< of each pixel: 1 is white paper in nominal light
  Image image{};

  [[nodiscard]] const SE3& pose(int row, int sample) const {
    return map_T_cams[render::row_major(rolling ? row : 0, samples, sample)];
  }
};

namespace render {

inline constexpr int kToneSteps = 16;  ///< of a grey level

/// Seconds from the stamp to the middle of a row's exposure.
[[nodiscard]] double row_time_s(const SceneCamera::Parts& parts, double row);

/// Renders the light that falls on the pixels of one row of tiles.
void expose_band(SceneExposure& exposure, int band);

/// From light to grey levels: the lens, vignetting, noise, gamma, bytes. For the pixels of one row of tiles.
void read_out_band(SceneExposure& exposure, int band);
/// What read_out_band needs of a camera.
void prepare_sensor(SceneCamera::Parts& parts);

/// What is true of each tag of which a part is visible.
[[nodiscard]] std::vector<SceneTagTruth> truth_of(const SceneExposure& exposure, const CameraMotion& motion);

}  // namespace render
}  // namespace waymark
