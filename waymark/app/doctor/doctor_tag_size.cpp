#include "waymark/app/doctor/doctor_tag_size.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/live/camera_address.hpp"
#include "waymark/app/live/camera_watch.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

constexpr double kLook_s = 1;
constexpr double kNotWorthIt = 0.01;  // of the size
constexpr double kNoTrial = 0.03;

DoctorLine warning(std::string words, std::string command = "waymark doctor --help") {
  return {"tag size", DoctorLevel::Warn, std::move(words), std::move(command)};
}

/// What was asked for could not be looked at.
DoctorLine failed(std::string words, std::string command = "waymark doctor --help") {
  return {"tag size", DoctorLevel::Fail, std::move(words), std::move(command)};
}

/// A distance as seen, and its standard deviation.
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
  if (tags.empty()) return warning("no tag was in view", "waymark detect SOURCE --view");
  if (tags.size() > 1)
    return warning(fmt::format("{} tags are in view ({}): leave one", tags.size(), fmt::join(tags, ", ")));
  const std::vector<SeenDistance> seen = distances(detections, camera, trial.size_m);
  if (seen.empty()) return warning(*tags.begin() + ": its corners make no square");
  const SeenDistance& median = seen[seen.size() / 2];
  const double ratio = trial.distance_m / median.distance_m;
  const double sigma =
      std::hypot(median.sigma_m / median.distance_m, trial.distance_sigma_m / trial.distance_m);
  const std::string found =
      fmt::format("{} at {:.2f} m is {:.1f} mm (+- {:.1f}), ", *tags.begin(), trial.distance_m,
                  1000 * ratio * trial.size_m, 1000 * ratio * sigma * trial.size_m);
  if (sigma > kNoTrial)
    return warning(fmt::format("{}which is not significant: take a larger tag, or another distance", found));
  if (std::abs(ratio - 1) <= std::max(2 * sigma, kNotWorthIt))
    return {"tag size", DoctorLevel::Ok, fmt::format("{}as it should be ({:g})", found, 1000 * trial.size_m),
            ""};
  return warning(
      fmt::format("{}not {:g}: printed at {:.1f} %? Print at 100 %, or name the size that a ruler shows",
                  found, 1000 * trial.size_m, 100 * ratio),
      fmt::format("waymark teach --tag-size-m {:.4f}", ratio * trial.size_m));
}

DoctorLine check_tag_size(const std::string& address, const std::filesystem::path& calibration,
                          const TagSizeTrial& trial, const DoctorCancelled& cancelled) {
  if (calibration.empty())
    return failed("the size of a tag can only be measured with the camera's calibration",
                  "waymark doctor --camera FILE");
  const auto camera = read_camera(calibration);
  if (!camera) return failed(to_string(camera.error()), "waymark calibrate camera --help");
  const auto finder = make_tag_finder({.families = trial.families});
  if (!finder) return failed(to_string(finder.error()));
  const auto source = open_live_camera(address);
  if (!source) return failed(to_string(source.error()), "waymark cameras");
  std::vector<TagDetection> detections;
  CameraWatch watch;
  watch.duration_s = kLook_s;
  watch.camera = &camera->camera;
  watch.should_stop = cancelled;
  watch.on_picture = [&](CameraPicture& picture) {
    detections.insert(detections.end(), picture.found.detections.begin(), picture.found.detections.end());
    return Status();
  };
  const auto end = watch_camera(**source, *finder, watch);
  if (!end) return failed(to_string(end.error()), "waymark cameras");
  return check_tag_size(detections, camera->camera, trial);
}

}  // namespace waymark
