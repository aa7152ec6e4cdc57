#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/mapping/scene/tag_scene.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

/// Scenes of many tags without a floor: a walk through aisles, a room with a ceiling of tags seen from below.
namespace waymark::test {

struct WideScene {
  TagScene scene{};
  SceneRecording recording{};
  std::map<int, SE3> truth{};    ///< map_T_tag by number
  std::vector<SE3> map_T_cam{};  ///< by frame
  std::size_t detections = 0;
};

namespace internal {

inline constexpr double kSceneTagM = 0.25;

/// One camera on a moving body, tags on a static wall; the pose of number 0 is known.
inline WideScene empty_scene(const std::map<int, SE3>& tags) {
  const auto exactly = [](const SE3& mean) {
    return ScenePrior::of(mean, Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-4));
  };
  WideScene wide{.truth = tags};
  wide.scene.bodies.push_back(
      {.name = "hall", .map_T_body = exactly(SE3()), .default_tag_size_m = kSceneTagM});
  wide.scene.bodies.push_back({.name = "rig", .is_static = false});
  wide.scene.default_body = 0;
  wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, 0}, kSceneTagM, exactly(tags.at(0))});
  wide.scene.cameras.push_back(
      {.name = "cam0",
       .topic = "/tags",
       .model =
           CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value(),
       .body = 1,
       .body_T_cam = exactly(SE3())});
  return wide;
}

/// Adds the camera's observations from these poses, the nearest tags first, at most this many per frame.
inline void film(WideScene& wide, const std::vector<SE3>& map_T_cam, double farthest_m, std::size_t most,
                 double noise_px, Random& random) {
  const auto cell = [](const Eigen::Vector3d& p) {
    return std::pair(static_cast<int>(std::floor(p.x() / 2)), static_cast<int>(std::floor(p.y() / 2)));
  };
  std::map<std::pair<int, int>, std::vector<int>> by_cell;
  for (const auto& [id, map_T_tag] : wide.truth) by_cell[cell(map_T_tag.translation())].push_back(id);
  const std::size_t first = wide.recording.frames.size();
  wide.map_T_cam.insert(wide.map_T_cam.end(), map_T_cam.begin(), map_T_cam.end());
  const int reach = static_cast<int>(std::ceil(farthest_m / 2));
  for (std::size_t f = 0; f < map_T_cam.size(); ++f) {
    const SE3 cam_T_map = map_T_cam[f].inverse();
    const auto [x, y] = cell(map_T_cam[f].translation());
    std::vector<std::pair<double, int>> near;
    for (int dx = -reach; dx <= reach; ++dx) {
      for (int dy = -reach; dy <= reach; ++dy) {
        const auto here = by_cell.find({x + dx, y + dy});
        if (here == by_cell.end()) continue;
        for (int id : here->second) {
          const double distance = (cam_T_map * wide.truth.at(id)).translation().norm();
          if (distance <= farthest_m) near.emplace_back(distance, id);
        }
      }
    }
    std::ranges::sort(near);
    SceneView view{.camera = 0};
    for (const auto& [distance, id] : near) {
      if (view.detections.size() == most) break;
      const auto corners =
          visible_corners(wide.scene.cameras[0].model, cam_T_map * wide.truth.at(id), kSceneTagM);
      if (!corners) continue;
      TagDetection detection{
          .tag = {FamilyId::TagStandard52h13, id}, .decision_margin = 60, .corners_px = *corners};
      for (Eigen::Vector2d& corner : detection.corners_px) {
        corner.x() += noise_px * random.normal();
        corner.y() += noise_px * random.normal();
      }
      view.detections.push_back(detection);
    }
    wide.detections += view.detections.size();
    const SensorTime stamp{std::chrono::milliseconds(100 * static_cast<std::int64_t>(first + f))};
    wide.recording.frames.push_back({stamp, {view}});
  }
}

}  // namespace internal

/// A walk up one aisle, around a half circle, down the next, with signs on alternate sides of the path, about
/// five of them per image, without odometry. If a tag is `moved`, the same walk follows once more, with this
/// tag moved in its own frame; `truth` then has its last pose.
inline WideScene aisles(int tags, std::uint64_t seed, double noise_px = 0.2,
                        const std::map<int, SE3>& moved = {}) {
  constexpr double kAisleM = 30;
  constexpr double kRadiusM = 1.5;
  constexpr double kStepM = 0.07;
  constexpr double kSignM = 0.35;
  Random random(seed);
  std::vector<SE2> way;
  SE2 at(0, 0, 0);
  const double turn = std::numbers::pi * kRadiusM;
  const auto steps = static_cast<std::size_t>(kSignM * tags / kStepM);
  std::map<int, SE3> signs;
  double next = 0;
  for (std::size_t i = 0; i < steps; ++i) {
    const double s = kStepM * static_cast<double>(i);
    const double within = std::fmod(s, kAisleM + turn);
    const double side = static_cast<int>(s / (kAisleM + turn)) % 2 == 0 ? 1 : -1;
    if (s >= next && std::ssize(signs) < tags) {
      const int id = static_cast<int>(signs.size());
      const double left = id % 2 == 0 ? 1 : -1;
      const double wobble = random.uniform(-0.1, 0.1);
      const SE2 sign = at * SE2(2, (0.8 + wobble) * left, 0.5 * left);
      signs[id] =
          SE3(SO3::from_rpy(0, 0, sign.yaw()) * body_R_optical(), {sign.x(), sign.y(), 0.2 * (id % 5)});
      next += kSignM;
    }
    way.push_back(at);
    at = at * SE2::exp({kStepM, 0, within < kAisleM ? 0 : side * kStepM / kRadiusM});
  }
  WideScene wide = internal::empty_scene(signs);
  std::vector<SE3> map_T_cam;
  for (const SE2& pose : way) {
    const SE3 map_T_base = SE3(SO3::from_rpy(0, 0, pose.yaw()), {pose.x(), pose.y(), 0.4});
    map_T_cam.push_back(map_T_base * SE3(body_R_optical(), Eigen::Vector3d::Zero()));
  }
  internal::film(wide, map_T_cam, 3.6, 7, noise_px, random);
  for (const auto& [id, by] : moved) wide.truth.at(id) = wide.truth.at(id) * by;
  if (!moved.empty()) internal::film(wide, map_T_cam, 3.6, 7, noise_px, random);
  return wide;
}

/// A room whose ceiling is covered with tags, seen from below in lanes; at this distance about 20 of them are
/// in an image, or 37 from 3.4 m.
inline WideScene ceiling(int tags, std::uint64_t seed, double noise_px = 0.2, double below_m = 2.6) {
  constexpr double kPitchM = 0.6;
  constexpr double kLaneM = 1.2;
  Random random(seed);
  const int rows = static_cast<int>(std::ceil(std::sqrt(tags)));
  std::map<int, SE3> grid;
  for (int id = 0; id < tags; ++id)
    grid[id] = SE3(SO3::from_rpy(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-3, 3)),
                   {kPitchM * (id % rows), kPitchM * (id / rows), below_m + random.uniform(-0.2, 0.2)});
  WideScene wide = internal::empty_scene(grid);
  std::vector<SE3> map_T_cam;
  const double side = kPitchM * rows;
  int lane = 0;
  for (double y = 0; y < side; y += kLaneM, ++lane) {
    for (double x = 0; x < side; x += 0.3) {
      const double along = lane % 2 == 0 ? x : side - x;
      map_T_cam.emplace_back(SO3::from_rpy(0.05 * random.normal(), 0.05 * random.normal(), 0.1 * lane),
                             Eigen::Vector3d(along, y, 0));
    }
  }
  internal::film(wide, map_T_cam, 6, 1000, noise_px, random);
  return wide;
}

/// Adds odometry with this noise of each motion between frames.
inline void add_odometry(WideScene& wide, double sigma_m, double sigma_rad, std::uint64_t seed) {
  Random random(seed);
  wide.scene.bodies[1].odometry = {.sigma_m = sigma_m, .sigma_rad = sigma_rad};
  SE3 odom_T_cam;
  for (std::size_t f = 0; f < wide.map_T_cam.size(); ++f) {
    Vector6 error;
    for (Eigen::Index i = 0; i < 6; ++i) error[i] = (i < 3 ? sigma_m : sigma_rad) * random.normal();
    if (f > 0)
      odom_T_cam = odom_T_cam * SE3::exp(error) * (wide.map_T_cam[f - 1].inverse() * wide.map_T_cam[f]);
    wide.recording.odometry.push_back({wide.recording.frames[f].stamp, 1, odom_T_cam});
  }
}

/// Keeps only the nearest tag in each frame, so that no frame shows two tags. Returns the number of tags that
/// are left in at least two frames.
inline std::size_t keep_nearest(WideScene& wide) {
  std::map<int, int> frames;
  wide.detections = 0;
  for (SceneFrame& frame : wide.recording.frames) {
    std::vector<TagDetection>& seen = frame.views[0].detections;
    if (seen.empty()) continue;
    seen.erase(seen.begin() + 1, seen.end());
    ++frames[seen[0].tag.number];
    ++wide.detections;
  }
  return static_cast<std::size_t>(
      std::ranges::count_if(frames, [](const auto& tag) { return tag.second >= 2; }));
}

/// Replaces the id of this fraction of the detections by another one of the set. Returns the number of
/// replacements.
inline std::size_t misread(SceneRecording& recording, int ids, double share, std::uint64_t seed) {
  Random random(seed);
  std::size_t wrong = 0;
  for (SceneFrame& frame : recording.frames) {
    for (SceneView& view : frame.views) {
      for (TagDetection& detection : view.detections) {
        if (random.uniform() >= share) continue;
        const int off = 1 + static_cast<int>(random.index(static_cast<std::uint64_t>(ids) - 1));
        detection.tag.number = (detection.tag.number + off) % ids;
        ++wrong;
      }
    }
  }
  return wrong;
}

}  // namespace waymark::test
