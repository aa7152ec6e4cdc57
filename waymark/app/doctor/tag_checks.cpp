#include "waymark/app/doctor/tag_checks.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/pipeline/expected_tags.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

constexpr double kMapLook_s = 2;
constexpr int kMissPeriod = 5;  // a tag is reported if it is missed in more than one out of this many images

DoctorLine map_warning(std::string words, std::string command) {
  return {"map", DoctorLevel::Warn, std::move(words), std::move(command)};
}
/// A line for a check that could not be performed.
DoctorLine map_failed(std::string words, std::string command) {
  return {"map", DoctorLevel::Fail, std::move(words), std::move(command)};
}

/// Whether the pose is certain enough to predict where other tags appear in the image.
bool certain(const CameraPoseEstimate& pose) {
  constexpr double kMaxSigma_m = 0.1;
  constexpr double kMaxSigma_rad = 0.05;
  const PoseDeviations sigma = standard_deviations(pose.map_T_cam, pose.covariance);
  return sigma.position_m.maxCoeff() <= kMaxSigma_m && sigma.rotation_rad.maxCoeff() <= kMaxSigma_rad;
}

}  // namespace

int ExpectedTagCount::times_missed() const {
  int times = 0;
  for (const auto& [reason, count] : missed) times += count;
  return times;
}

void MapTagTrial::add(const ImageView& image, const std::vector<TagDetection>& found, const TagMap& map,
                      const CameraModel& camera, int min_white_black_diff) {
  ++images;
  const bool any =
      std::ranges::any_of(found, [&](const TagDetection& one) { return map.find(one.tag) != nullptr; });
  if (!any) return;
  ++with_tags;
  const auto pose = estimate_camera_pose(found, map, camera);
  if (!pose || !pose->usable() || !certain(pose->estimates.front())) return;
  ++placed;
  const auto expected = expected_tags(map, camera, pose->estimates.front().map_T_cam);
  for (const ExpectedTag& one : expected) ++tags[one.tag].expected;
  for (const MissedTag& one : missed_tags(image, expected, found, min_white_black_diff))
    ++tags[one.expected.tag].missed[one.why];
}

DoctorLine check_map_tags(const MapTagTrial& trial, const std::string& view_command) {
  const std::string images = counted(static_cast<std::size_t>(trial.images), "image");
  if (trial.with_tags == 0)
    return map_failed(fmt::format("no map tag was detected in {}", images), view_command);
  if (trial.placed == 0)
    return map_warning(
        fmt::format("map tags were detected in {} of {}, but the camera pose is ambiguous. Move the camera "
                    "closer, or so that several tags are in view. Is the calibration that of this camera?",
                    trial.with_tags, images),
        view_command);
  std::vector<std::string> missed;
  for (const auto& [tag, count] : trial.tags)
    if (count.times_missed() * kMissPeriod > count.expected)
      missed.push_back(fmt::format("{} in {} of {} ({})", to_string(tag), count.times_missed(),
                                   count.expected, counted_reasons(count.missed)));
  const std::string all = counted(trial.tags.size(), "map tag");
  if (missed.empty())
    return {"map", DoctorLevel::Ok, fmt::format("{} expected from here and detected, in {}", all, images),
            ""};
  return map_warning(
      fmt::format("{} expected from here, {} missed: {}", all, missed.size(), fmt::join(missed, ", ")),
      view_command);
}

DoctorLine check_map_tags(const std::string& address, const std::filesystem::path& calibration,
                          const std::filesystem::path& map, const DoctorCancelled& cancelled) {
  if (calibration.empty())
    return map_failed("the check of map tags needs the camera's calibration",
                      fmt::format("waymark doctor camera=FILE camera_source={} map={}", shell_word(address),
                                  shell_word(map.string())));
  const auto camera = read_camera(calibration);
  if (!camera) return map_failed(to_string(camera.error()), "waymark calibrate camera help=true");
  const auto file = read_map(map_file_of(map));
  if (!file) return map_failed(to_string(file.error()), "waymark map help=true");
  DetectorOptions options{.families = families_of(file->tags)};
  for (const auto& [tag, mapped] : file->tags.tags) options.known_tags.push_back(tag);
  const auto finder = make_tag_finder(options);
  if (!finder) return map_failed(to_string(finder.error()), "waymark map help=true");
  const auto source = open_live_camera(address);
  if (!source) return map_failed(to_string(source.error()), "waymark cameras");
  MapTagTrial trial;
  CameraWatch watch{.lens = ImageLens::of(camera->camera)};
  watch.duration_s = kMapLook_s;
  watch.should_stop = cancelled;
  watch.on_image = [&](CameraImage& image) {
    trial.add(image.frame.image.view(), image.found.detections, file->tags, camera->camera,
              options.min_white_black_diff);
    return Status();
  };
  const auto end = watch_camera(**source, *finder, watch);
  if (!end) return map_failed(to_string(end.error()), "waymark cameras");
  return check_map_tags(trial, "waymark detect " + address + " view=true");
}

namespace {

constexpr double kTagLook_s = 1;
constexpr double kMinError = 0.01;  // relative; smaller size errors are not reported
constexpr double kMaxSigma = 0.03;  // relative; above this, the measurement is not significant

DoctorLine tag_warning(std::string words, std::string command = "waymark doctor help=true") {
  return {"tag size", DoctorLevel::Warn, std::move(words), std::move(command)};
}

/// A line for a measurement that could not be performed.
DoctorLine tag_failed(std::string words, std::string command = "waymark doctor help=true") {
  return {"tag size", DoctorLevel::Fail, std::move(words), std::move(command)};
}

/// An estimated distance and its standard deviation.
struct SeenDistance {
  double distance_m = 0;
  double sigma_m = 0;
};

std::vector<SeenDistance> distances(std::span<const TagDetection> detections, const CameraModel& camera,
                                    double size_m) {
  std::vector<SeenDistance> all;
  for (const TagDetection& detection : detections) {
    const auto pose = estimate_tag_pose(detection, size_m, camera);
    if (!pose) continue;
    const SE3& cam_T_tag = pose->best.cam_T_tag;
    const PoseDeviations deviations = standard_deviations(cam_T_tag, pose->best.covariance);
    all.push_back({cam_T_tag.translation().norm(), deviations.position_m.norm()});
  }
  std::ranges::sort(all, {}, &SeenDistance::distance_m);
  return all;
}

}  // namespace

DoctorLine check_tag_size(std::span<const TagDetection> detections, const CameraModel& camera,
                          const TagSizeTrial& trial) {
  std::set<std::string> tags;
  for (const TagDetection& detection : detections) tags.insert(to_string(detection.tag));
  if (tags.empty()) return tag_warning("no tag in view", "waymark detect SOURCE view=true");
  if (tags.size() > 1)
    return tag_warning(
        fmt::format("{} tags in view ({}): leave only one", tags.size(), fmt::join(tags, ", ")));
  const std::vector<SeenDistance> seen = distances(detections, camera, trial.size_m);
  if (seen.empty()) return tag_warning(*tags.begin() + ": its corners are not those of a square");
  const SeenDistance& median = seen[seen.size() / 2];
  const double ratio = trial.distance_m / median.distance_m;
  const double sigma =
      std::hypot(median.sigma_m / median.distance_m, trial.distance_sigma_m / trial.distance_m);
  const std::string found =
      fmt::format("{} at {:.2f} m is {:.1f} mm (+- {:.1f}), ", *tags.begin(), trial.distance_m,
                  1000 * ratio * trial.size_m, 1000 * ratio * sigma * trial.size_m);
  if (sigma > kMaxSigma)
    return tag_warning(fmt::format("{}not significant: use a larger tag, or another distance", found));
  if (std::abs(ratio - 1) <= std::max(2 * sigma, kMinError))
    return {"tag size", DoctorLevel::Ok, fmt::format("{}as specified ({:g})", found, 1000 * trial.size_m),
            ""};
  return tag_warning(
      fmt::format("{}not {:g}: printed at {:.1f} %? Print at 100 %, or give the size measured with a ruler",
                  found, 1000 * trial.size_m, 100 * ratio),
      fmt::format("waymark teach tag_size_m={:.4f}", ratio * trial.size_m));
}

DoctorLine check_tag_size(const std::string& address, const std::filesystem::path& calibration,
                          const TagSizeTrial& trial, const DoctorCancelled& cancelled) {
  if (calibration.empty())
    return tag_failed("measuring the size of a tag needs the camera's calibration",
                      "waymark doctor camera=FILE");
  const auto camera = read_camera(calibration);
  if (!camera) return tag_failed(to_string(camera.error()), "waymark calibrate camera help=true");

  const auto finder = make_tag_finder({.families = trial.families});
  if (!finder) return tag_failed(to_string(finder.error()));
  const auto source = open_live_camera(address);
  if (!source) return tag_failed(to_string(source.error()), "waymark cameras");
  std::vector<TagDetection> detections;
  CameraWatch watch{.lens = ImageLens::of(camera->camera)};
  watch.duration_s = kTagLook_s;
  watch.should_stop = cancelled;
  watch.on_image = [&](CameraImage& image) {
    detections.insert(detections.end(), image.found.detections.begin(), image.found.detections.end());
    return Status();
  };
  const auto end = watch_camera(**source, *finder, watch);
  if (!end) return tag_failed(to_string(end.error()), "waymark cameras");
  return check_tag_size(detections, camera->camera, trial);
}

}  // namespace waymark
