#pragma once

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/world/world.hpp"

/// A person walks once around a room with a hand-held camera and films the tags on its walls.
namespace waymark::testing {

struct HandWalkOptions {
  double seconds = 30, rate_hz = 30;
  double readout_s = 0.015;  ///< of a rolling shutter
  double white_px = 0.1;     ///< white noise of a corner coordinate
  double lasting_px = 0.05;  ///< correlated noise: exp(-t / 0.15 s)
  double farthest_m = 5;
};

/// 24 tags on the four walls of a room of 6 m x 5 m. Tag 0 hangs upright in the middle of the wall x = 3.
inline World walk_room(double tag_size_m) {
  constexpr double kPi = std::numbers::pi;
  World world{.name = "walk"};
  for (int i = 0; i < 24; ++i) {
    const int wall = i / 6;
    const double along = (i % 6 - (wall == 0 ? 0 : 2.5)) * 0.85;
    const double s =
        wall == 0 ? (i % 6 == 0 ? 0 : (i % 6 % 2 == 1 ? 1 : -1) * 0.8 * ((i % 6 + 1) / 2)) : along;
    const double height = 1.4 + (i == 0 ? 0 : 0.25 * std::sin(2.3 * i));
    const bool side = wall % 2 == 0;
    const double sign = wall < 2 ? 1 : -1;
    const Eigen::Vector3d at(side ? sign * 3 : s, side ? s : sign * 2.5, height);
    const double facing = side ? (sign > 0 ? kPi : 0) : -sign * kPi / 2;
    const SE3 hung =
        upright_tag(at, facing) * SE3(SO3::exp({0, 0, i == 0 ? 0 : 0.1 * std::sin(1.7 * i)}), {0, 0, 0});
    world.tags.tags[{FamilyId::Tag36h11, i}] = {.map_T_tag = hung, .size_m = tag_size_m};
  }
  world.anchor = {FamilyId::Tag36h11, 0};
  return world;
}

/// Steps, sway and tremor, different for each walk.
class HandWalk {
 public:
  HandWalk(Random& random, double seconds) : seconds_(seconds) {
    for (Wave& wave : waves_) {
      wave.hz = random.uniform(0.4, 2.5);
      wave.phase = random.uniform(0, 2 * std::numbers::pi);
      wave.size = random.uniform(0.4, 1) / (1 + wave.hz);
    }
    start_ = random.uniform(-0.2, 0.2);
  }

  /// map_T_cam, looking outwards.
  [[nodiscard]] SE3 at(double t_s) const {
    const double turn = start_ + 2.15 * std::numbers::pi * t_s / seconds_;
    const Eigen::Vector3d where(1.2 * std::cos(turn) + 0.03 * wave(0, t_s),
                                0.8 * std::sin(turn) + 0.03 * wave(1, t_s), 1.45 + 0.03 * wave(2, t_s));
    const SO3 look = SO3::from_rpy(0.05 * wave(3, t_s), 0.05 * wave(4, t_s), turn + 0.06 * wave(5, t_s));
    return {look * SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()), where};
  }

 private:
  struct Wave {
    double hz = 1, phase = 0, size = 1;
  };
  /// One coordinate: two waves.
  [[nodiscard]] double wave(std::size_t coordinate, double t_s) const {
    double sum = 0;
    for (std::size_t k : {coordinate, coordinate + 6})
      sum += waves_[k].size * std::sin(2 * std::numbers::pi * waves_[k].hz * t_s + waves_[k].phase);
    return sum;
  }

  double seconds_;
  double start_ = 0;
  std::array<Wave, 12> waves_{};
};

/// Corners of a tag, each at the time of its own row; empty if it is not visible.
inline std::optional<std::array<Eigen::Vector2d, 4>> rolling_corners(const CameraModel& camera,
                                                                     const HandWalk& walk, double t_s,
                                                                     double readout_s, const MappedTag& tag) {
  std::array<Eigen::Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d map_p = tag.map_T_tag * tag_corners(tag.size_m)[i];
    double t = 0;
    for (int k = 0; k < 6; ++k) {  // a contraction: motion during the readout is small
      const auto px = camera.project(walk.at(t_s + t).inverse() * map_p);
      if (!px) return std::nullopt;
      corners[i] = *px;
      t = (px->y() / camera.height_px() - 0.5) * readout_s;
    }
  }
  for (const Eigen::Vector2d& c : corners) {
    constexpr double kEdge_px = 10;
    if (c.x() < kEdge_px || c.y() < kEdge_px || c.x() > camera.width_px() - kEdge_px ||
        c.y() > camera.height_px() - kEdge_px)
      return std::nullopt;
  }
  return corners;
}

/// Detections of the walk, generated without rendering images.
inline std::vector<SceneFrame> walked_views(const World& world, const CameraModel& camera,
                                            const HandWalk& walk, const HandWalkOptions& options,
                                            Random& random) {
  std::vector<SceneFrame> frames;
  std::map<TagId, std::array<Eigen::Vector2d, 4>> lasting;
  const double stays = std::exp(-1 / (0.15 * options.rate_hz));
  const auto noise = [&] { return Eigen::Vector2d(random.normal(), random.normal()); };
  for (int k = 0; k < options.seconds * options.rate_hz; ++k) {
    const double t_s = k / options.rate_hz;
    SceneView view;
    for (const auto& [id, tag] : world.tags.tags) {
      const SE3 cam_T_tag = walk.at(t_s).inverse() * tag.map_T_tag;
      const bool seen =
          cam_T_tag.translation().norm() < options.farthest_m &&
          (cam_T_tag.rotation() * Eigen::Vector3d::UnitZ()).dot(cam_T_tag.translation().normalized()) > 0.3;
      auto corners = seen ? rolling_corners(camera, walk, t_s, options.readout_s, tag) : std::nullopt;
      if (!corners) continue;
      const auto [last, fresh] = lasting.try_emplace(id);
      for (std::size_t i = 0; i < 4; ++i) {
        Eigen::Vector2d& error = last->second[i];
        error = fresh ? Eigen::Vector2d(options.lasting_px * noise())
                      : Eigen::Vector2d(stays * error +
                                        options.lasting_px * std::sqrt(1 - stays * stays) * noise());
        (*corners)[i] += error + options.white_px * noise();
      }
      view.detections.push_back({.tag = id, .corners_px = *corners});
    }
    frames.push_back({SensorTime(Duration(std::llround(t_s * 1e9))), {std::move(view)}});
  }
  return frames;
}

}  // namespace waymark::testing
