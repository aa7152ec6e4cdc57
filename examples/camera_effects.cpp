// Every effect of the simulated camera as an image: without it on the left, with it on the right.
//   usage: waymark_camera_effects OUT_DIR      writes blur.jpg, noise.jpg, ... there (docs/images/camera)
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/simulation/render/scene_camera.hpp"

namespace waymark {
namespace {

constexpr int kWidth = 400;
constexpr int kHeight = 300;
constexpr int kQuality = 88;

CameraModel camera(const CameraModel::Projection& projection) {
  return CameraModel::make(projection, kWidth, kHeight).value();
}
CameraModel straight() { return camera(PinholeRadtan{.fx = 300, .fy = 300, .cx = 200, .cy = 150}); }

/// Three tags in front of a wall, a box that hides part of one, a tiled floor.
World corner_of_a_room() {
  World world;
  const auto add = [&](int number, double x, double y, double z, double facing_deg) {
    world.tags.tags[{FamilyId::Tag36h11, number}] = {
        .map_T_tag = upright_tag({x, y, z}, facing_deg * std::numbers::pi / 180), .size_m = 0.16};
  };
  add(7, 1.05, 0.27, 0.30, -160);
  add(21, 1.40, -0.02, 0.36, 180);
  add(42, 1.10, -0.42, 0.27, 135);
  world.walls.push_back({.from_m = {2.2, -3}, .to_m = {2.2, 3}, .height_m = 1.2});
  world.occluders.push_back({.centre_m = {1.6, 0.55, 0.15}, .yaw_rad = 0.5, .size_m = {0.3, 0.3, 0.3}});
  world.floor = {.texture = "tiles", .reflectance = 0.5, .contrast = 0.3, .cell_m = 0.3};
  return world;
}

/// A camera 0.3 m above the floor, facing map x and slightly down; it turns left at a given rate while
/// driving.
CameraMotion drive(double speed_m_s, double yaw_rate_rad_s) {
  Eigen::Matrix3d ahead;
  ahead << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SO3 base_R_cam = SO3::from_rpy(0, 0.05, 0) * SO3::from_matrix(ahead);
  return [=](double t) {
    return SE3(SO3::from_rpy(0, 0, yaw_rate_rad_s * t) * base_R_cam, {speed_m_s * t, 0, 0.3});
  };
}

/// One image: scene, camera and motion.
struct Shot {
  Scene scene = scene_of(corner_of_a_room());
  CameraModel model = straight();
  SceneCameraOptions options = {.exposure_ms = 0, .white_level_dn = 230, .ambient = 0.85};
  CameraMotion motion = drive(0, 0);
  double stamp_s = 0;
};

Result<Image> through_jpeg(const Image& image, int quality) {
  if (quality == 0) return image;
  const auto bytes = encode_jpeg(image, quality);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, "image");
}

Result<Image> take(const Shot& shot) {
  const auto camera = SceneCamera::make(shot.scene, shot.model, shot.options);
  if (!camera) return tl::unexpected(camera.error());
  const SensorTime stamp{Duration(std::llround(shot.stamp_s * 1e9))};
  const auto frame = camera->render(shot.motion, stamp, 1);
  if (!frame) return tl::unexpected(frame.error());
  return through_jpeg(frame->image, shot.options.jpeg_quality);
}

Image beside(const Image& left, const Image& right) {
  constexpr int kGap = 8;
  Image both(left.width() + kGap + right.width(), left.height(), 255);
  for (int y = 0; y < left.height(); ++y) {
    std::copy_n(left.row(y), left.width(), both.row(y));
    std::copy_n(right.row(y), right.width(), both.row(y) + left.width() + kGap);
  }
  return both;
}

/// The surroundings of the middle tag, each pixel as a square of `times` pixels.
Image magnified(const Image& image, int times) {
  constexpr int kTagX = 207;
  constexpr int kTagY = 122;
  const int left = kTagX - kWidth / times / 2;
  const int top = kTagY - kHeight / times / 2;
  Image large(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) large.row(y)[x] = image.row(top + y / times)[left + x / times];
  }
  return large;
}

/// The change of a shot by an effect.
struct Effect {
  const char* name;
  std::function<void(Shot&)> before;  ///< for both images
  std::function<void(Shot&)> effect;  ///< for the right one
  int magnify = 1;
};

void nothing(Shot&) {}
void noiseless_turn(Shot& shot) { shot.motion = drive(0.3, 1.2); }

std::vector<Effect> motion_effects() {
  return {
      {"exposure", noiseless_turn, [](Shot& s) { s.options.exposure_ms = 30; }},
      {"rolling_shutter", [](Shot& s) { s.motion = drive(0, 3); },
       [](Shot& s) { s.options.readout_ms = 30; }},
  };
}

std::vector<Effect> lens_effects() {
  return {
      {"distortion",
       [](Shot& s) {
         s.model = camera(PinholeRadtan{
             .fx = 230, .fy = 230, .cx = 200, .cy = 150, .k = {-0.25, 0.04, 0, 0}, .coefficients = 4});
       },
       [](Shot& s) { s.model = camera(Equidistant{.fx = 130, .fy = 130, .cx = 200, .cy = 150}); }},
      {"lens_spread", [](Shot& s) { s.options.lens_sigma_px = 0; },
       [](Shot& s) { s.options.lens_sigma_px = 0.8; }, 5},
      {"defocus", nothing,
       [](Shot& s) {
         s.options.aperture_mm = 12;
         s.options.focus_distance_m = 0.45;
       }},
      {"vignetting", nothing, [](Shot& s) { s.options.vignetting_power = 4; }},
  };
}

std::vector<Effect> light_effects() {
  return {
      {"drift",
       [](Shot& s) {
         s.options.drift = 0.5;
         s.options.drift_period_s = 20;
         s.stamp_s = 5;
       },
       [](Shot& s) { s.stamp_s = 15; }},
      {"flicker", [](Shot& s) { s.options.readout_ms = 30; },
       [](Shot& s) {
         s.options.exposure_ms = 2;
         s.options.flicker = 0.5;
       }},
      {"glare", nothing,
       [](Shot& s) {
         s.scene.map_t_lamp = {0.12, -0.05, 0.45};
         for (SceneSurface& surface : s.scene.surfaces) surface.finish.gloss = surface.tag ? 1.0 : 0.0;
       }},
      {"occluder", nothing,
       [](Shot& s) {
         const SE3 leg(upright_tag({0.8, 0.12, 0.3}, std::numbers::pi));
         s.scene.surfaces.push_back(plain_surface(leg, 0.10, 0.6, {.reflectance = 0.12}));
       }},
  };
}

std::vector<Effect> sensor_effects() {
  return {
      {"noise", nothing,
       [](Shot& s) {
         s.options.full_well_electrons = 1500;
         s.options.read_noise_electrons = 12;
       }},
      {"gamma", nothing, [](Shot& s) { s.options.gamma = 2.2; }},
      {"jpeg", nothing, [](Shot& s) { s.options.jpeg_quality = 15; }, 4},
  };
}

Status write_pair(const std::filesystem::path& folder, const Effect& effect) {
  Shot without;
  without.options.full_well_electrons = 0;
  effect.before(without);
  Shot with = without;
  effect.effect(with);
  Result<Image> left = take(without);
  Result<Image> right = take(with);
  if (!left) return tl::unexpected(left.error());
  if (!right) return tl::unexpected(right.error());
  if (effect.magnify > 1) {
    left = magnified(*left, effect.magnify);
    right = magnified(*right, effect.magnify);
  }
  const auto bytes = encode_jpeg(beside(*left, *right), kQuality);
  if (!bytes) return tl::unexpected(bytes.error());
  return write_bytes(folder / (std::string(effect.name) + ".jpg"), *bytes);
}

Status run(const std::filesystem::path& folder) {
  for (const auto& effects : {motion_effects(), lens_effects(), light_effects(), sensor_effects()}) {
    for (const Effect& effect : effects) {
      if (Status status = write_pair(folder, effect); !status) return status;
    }
  }
  return {};
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: waymark_camera_effects OUT_DIR\n", stderr);
    return 2;
  }
  const waymark::Status status = waymark::run(argv[1]);
  if (status) return 0;
  std::fprintf(stderr, "waymark_camera_effects: %s\n", waymark::to_string(status.error()).c_str());
  return 1;
}
