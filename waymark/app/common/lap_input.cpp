#include "waymark/app/common/lap_input.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <set>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/tags/no_tags.hpp"

namespace waymark {
namespace {

std::optional<double> parse_number(std::string_view text) {
  double value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

Result<SE3> pose_of(std::string_view text) {
  std::vector<double> n;
  while (!text.empty()) {
    const std::size_t end = text.find(' ');
    const auto value = parse_number(text.substr(0, end));
    if (value) n.push_back(*value);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  if (n.size() != 7) return fail(ErrorCode::Unreadable, "the anchor pose does not have seven numbers");
  const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(n[6], n[3], n[4], n[5]));
  if (!rotation) return tl::unexpected(rotation.error());
  return SE3(*rotation, {n[0], n[1], n[2]});
}

std::optional<std::string> metadata(const RecordingSetup& setup, const std::string& key) {
  const auto block = setup.metadata.find(lap_facts::kMetadata);
  if (block == setup.metadata.end()) return std::nullopt;
  const auto value = block->second.find(key);
  return value == block->second.end() ? std::nullopt : std::optional(value->second);
}

/// Returns tag36h11 and, if the recording specifies an anchor, its family.
std::vector<std::string> usual_families(MessageLog& log, const CameraChoice& choice) {
  std::vector<std::string> families = DetectorOptions{}.families;
  const auto setup = log.setup(choice);
  const auto recorded = setup ? metadata(*setup, lap_facts::kAnchor) : std::nullopt;
  if (!recorded) return families;
  const auto anchor = tag_named(*recorded);
  if (!anchor) return families;
  const std::string family(to_string(anchor->family));
  if (std::ranges::find(families, family) == families.end()) families.push_back(family);
  return families;
}

Status fill_anchor(const RecordedLap& lap, const SetupOverrides& overrides, TeachSetup& setup) {
  const std::optional<std::string> recorded = metadata(lap.setup, lap_facts::kAnchor);
  if (!recorded && !overrides.anchor)
    return fail(ErrorCode::NotFound, "the recording does not specify the anchor tag", {},
                "Set `anchor` to an observed tag, for example `anchor=tag36h11:0`.");
  const Result<TagId> anchor =
      overrides.anchor ? tag_named(*overrides.anchor, "anchor") : tag_named(*recorded);
  if (!anchor) return tl::unexpected(anchor.error());
  setup.anchor = *anchor;
  setup.map_T_anchor = overrides.map_T_anchor.value_or(anchor_at_origin());
  if (overrides.map_T_anchor) return {};
  const std::optional<std::string> pose = metadata(lap.setup, lap_facts::kAnchorPose);
  if (!pose || (recorded && *recorded != to_string(*anchor))) {
    setup.anchor_pose_given = false;
    return {};
  }
  const Result<SE3> map_T_anchor = pose_of(*pose);
  if (!map_T_anchor) return tl::unexpected(map_T_anchor.error());
  setup.map_T_anchor = *map_T_anchor;
  return {};
}

}  // namespace

SE3 anchor_at_origin() {
  return {SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
          Eigen::Vector3d::Zero()};
}

Result<SE3> anchor_pose_of(const std::vector<double>& n) {
  const Place place{.key = "anchor_pose"};
  const char* how_to_write = "Give X Y Z in metres, then roll, pitch and yaw in degrees.";
  if (n.size() != 6)
    return fail(ErrorCode::InvalidArgument, fmt::format("expected six numbers, not {}", n.size()), place,
                how_to_write);
  if (!std::ranges::all_of(n, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "the numbers must be finite", place);
  constexpr double kMaxDistance_m = 1e4;
  if (std::ranges::any_of(n.begin(), n.begin() + 3, [](double x) { return std::abs(x) > kMaxDistance_m; }))
    return fail(ErrorCode::InvalidArgument, "the anchor is more than 10 km from the map origin", place,
                how_to_write);
  return SE3(SO3::from_rpy(to_radians(n[3]), to_radians(n[4]), to_radians(n[5])),
             Eigen::Vector3d(n[0], n[1], n[2]));
}

namespace {

/// Fails on a size outside the limits of printed tags, such as one that was recorded in centimetres.
Status check_sizes(const TagSizes& sizes) {
  if (Status size = check_printed_size(*sizes.default_size_m, "tag_size_m"); !size) return size;
  for (const auto& [tag, size_m] : sizes.size_by_tag_m) {
    if (Status size = check_printed_size(size_m, to_string(tag)); !size) return size;
  }
  return {};
}

/// Fails on the size of a tag of a family that was not observed, because it would be ignored.
Status check_size_families(const RecordedLap& lap, const SetupOverrides& overrides) {
  std::set<FamilyId> observed;
  for (const TagFrame& frame : lap.frames)
    for (const TagDetection& detection : frame.detections) observed.insert(detection.tag.family);
  if (observed.empty()) return {};
  for (const auto& [tag, size_m] : overrides.size_by_tag_m) {
    if (observed.contains(tag.family)) continue;
    const std::string_view family = to_string(*observed.begin());
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a size is set for {}, but the recording contains no tags of this family",
                            to_string(tag)),
                {.key = "tag_size_m"},
                fmt::format("Name an observed family, for example `tag_size_m={}:{}={:g}`.", family,
                            tag.number, size_m));
  }
  return {};
}

}  // namespace

Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides) {
  if (!lap.setup.camera && lap.setup.chosen.camera_error)
    return tl::unexpected(*lap.setup.chosen.camera_error);
  if (!lap.setup.camera) {
    const bool camera_alone = lap.odometry.empty() && lap.imu.empty();
    std::string message = "the recording contains no camera calibration (/camera_info)";
    if (camera_alone) message += " and no odometry";
    if (!lap.setup.problems.empty())  // the recording may be truncated
      message += fmt::format("; first problem found: {}", to_string(lap.setup.problems.front()));
    if (camera_alone)  // for a camera without a robot, a robot file does not help
      return fail(
          ErrorCode::NotFound, std::move(message), {},
          "To map the recording of one camera without a robot, use `waymark map video` with `camera`. "
          "For several cameras described by TagSLAM's files, use `waymark map tagslam=FOLDER`. "
          "`waymark info` lists the contents of the recording.");
    return fail(ErrorCode::NotFound, std::move(message), {},
                "Set `robot` to a robot file, or record sensor_msgs/CameraInfo as well. A table or bag of "
                "detections can be mapped with `waymark map tagslam=FOLDER` if TagSLAM's files describe "
                "the cameras and the tag sizes. `waymark info` lists the contents of the recording.");
  }
  if (!lap.setup.base_T_cam && lap.setup.chosen.mounting_error) {
    Error error = *lap.setup.chosen.mounting_error;
    error.message = "the recording does not specify the camera mounting: " + error.message;
    return tl::unexpected(std::move(error));
  }
  if (!lap.setup.base_T_cam)
    return fail(
        ErrorCode::NotFound,
        "the recording does not specify the camera mounting: no transforms (/tf_static, /tf) from the "
        "base to the camera's optical frame",
        {}, "Set `robot` to a robot file. `waymark info` lists the contents of the recording.");
  TeachSetup setup{.camera = *lap.setup.camera,
                   .base_T_cam = *lap.setup.base_T_cam,
                   .more_cameras = lap.setup.more_cameras};
  auto sizes = tag_sizes_of(lap, overrides);
  if (!sizes) return tl::unexpected(sizes.error());
  if (!sizes->default_size_m)
    return fail(ErrorCode::NotFound, "the recording does not specify the tag size", {},
                "Set `tag_size_m` to the side of the black square.");
  setup.sizes = std::move(*sizes);
  if (Status status = check_sizes(setup.sizes); !status) return tl::unexpected(status.error());
  if (Status status = check_size_families(lap, overrides); !status) return tl::unexpected(status.error());
  if (Status status = fill_anchor(lap, overrides, setup); !status) return tl::unexpected(status.error());
  return setup;
}

Result<TagSizes> tag_sizes_of(const RecordedLap& lap, const SetupOverrides& overrides) {
  std::istringstream words(metadata(lap.setup, lap_facts::kTagSizes).value_or(""));
  Result<TagSizes> sizes = parse_tag_sizes({std::istream_iterator<std::string>(words), {}});
  if (!sizes) {
    Error error = sizes.error();
    error.message = fmt::format("the recording's metadata {}: {}", lap_facts::kTagSizes, error.message);
    error.place = {};
    return tl::unexpected(std::move(error));
  }
  sizes->default_size_m = overrides.tag_size_m;
  if (!sizes->default_size_m)
    sizes->default_size_m = parse_number(metadata(lap.setup, lap_facts::kTagSize).value_or(""));
  for (const auto& [tag, size_m] : overrides.size_by_tag_m) sizes->size_by_tag_m[tag] = size_m;
  return sizes;
}

void add_tag_sizes(const TagSizes& sizes, std::map<std::string, std::string>& facts) {
  if (!sizes.default_size_m) return;
  facts[lap_facts::kTagSize] = fmt::format("{}", *sizes.default_size_m);
  std::string others;
  for (const auto& [tag, size_m] : sizes.size_by_tag_m)
    if (size_m != *sizes.default_size_m)
      others += fmt::format("{}{}={}", others.empty() ? "" : " ", to_string(tag), size_m);
  if (!others.empty()) facts[lap_facts::kTagSizes] = others;
}

Result<std::optional<World>> true_world(const RecordedLap& lap) {
  const auto text = lap.attachments.find(lap_facts::kWorldFile);
  if (text == lap.attachments.end()) return std::optional<World>();
  Result<World> world = parse_world(text->second, lap_facts::kWorldFile);
  if (!world) return tl::unexpected(world.error());
  return std::optional(std::move(*world));
}

std::optional<std::string> robot_yaml_of(const RecordedLap& lap) {
  const auto text = lap.attachments.find(lap_facts::kRobotFile);
  return text == lap.attachments.end() ? std::nullopt : std::optional(text->second);
}

Result<RecordedLap> read_lap_file(const std::string& path, const JobControl& control,
                                  const TagFinder* finder) {
  return read_lap_files({path}, control, finder, {});
}

Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths, const JobControl& control,
                                   const TagFinder* finder, const CameraChoice& choice) {
  const auto log = open_recordings(paths, control);
  if (!log) return tl::unexpected(log.error());
  std::optional<TagFinder> usual;  // created only when needed
  std::size_t beyond_lens = 0;
  NoTagDiagnosis no_tags;
  const FrameFinder find = [&](const CameraFrame& frame, ImageLens lens) -> Result<TagFrame> {
    if (control.cancelled())
      return fail(ErrorCode::Unreadable, "stopped before its tags were found", {.source = paths.front()});
    if (finder == nullptr && !usual) {
      auto made = make_tag_finder({.families = usual_families(**log, choice)});
      if (!made) return tl::unexpected(made.error());
      usual = std::move(*made);
    }
    if (lens.known()) {
      Status fits = check_camera_matches_image(*lens.camera(), frame.image.width(), frame.image.height());
      if (!fits) {
        fits.error().place.source = paths.front();
        return tl::unexpected(fits.error());
      }
    }
    Result<FoundTags> found = find_tags(frame.image, finder != nullptr ? *finder : *usual, lens);
    if (!found) return tl::unexpected(found.error());
    beyond_lens += found->beyond_lens;
    no_tags.add(frame.image, found->detections.size() + found->beyond_lens);
    control.progress({fmt::format("finding tags: {:.1f} s", to_seconds(frame.stamp.time_since_epoch()))});
    return TagFrame{frame.stamp, frame.camera, std::move(found->detections)};
  };
  Result<RecordedLap> lap =
      read_lap(**log, find, finder != nullptr ? TagSource::Images : TagSource::AsRecorded, choice);
  if (!lap && lap.error().code == ErrorCode::NotFound && lap.error().place.source.empty())
    lap.error().place.source = paths.front();
  if (lap && lap->setup.chosen.camera_error && lap->setup.chosen.camera_error->place.source.empty())
    lap->setup.chosen.camera_error->place.source = paths.front();
  if (lap && beyond_lens > 0) lap->notes.push_back(beyond_lens_note(beyond_lens));
  if (const std::size_t tags = lap ? count_unreliable(lap->frames) : 0; tags > 0)
    lap->notes.push_back(unreliable_note(tags));
  if (lap) take_better_fitting_camera(lap->setup, lap->frames);
  const TagFinder* used = finder;
  if (used == nullptr && usual) used = &*usual;
  if (lap && used != nullptr)
    if (const auto reason = no_tags.reason(used->tracking.detector)) lap->notes.push_back(reason->message);
  // The first problem may be the reason why images could not be read, for example their encoding.
  if (lap && lap->frames.empty() && lap->tag_poses.empty() && !lap->setup.problems.empty())
    lap->notes.push_back(to_string(lap->setup.problems.front()));
  if (lap)
    for (const auto* notes : {&lap->setup.chosen.notes, &lap->notes})
      for (const std::string& note : *notes) control.note("note: " + note);
  return lap;
}

namespace {

/// Mean squared residual of the corners of single tags [px^2], and the number of tags. A tag has eight corner
/// coordinates and its pose six unknowns, so a wrong camera model leaves residuals. They do not depend on the
/// size of the tag.
struct Misfit {
  double px2 = 0;
  std::size_t tags = 0;

  [[nodiscard]] double rms_px() const { return std::sqrt(px2); }
};

Misfit misfit_of(std::span<const TagFrame> frames, const CameraModel& camera) {
  constexpr std::size_t kMaxFrames = 400;
  const std::size_t step = frames.size() / kMaxFrames + 1;
  Misfit misfit;
  for (std::size_t i = 0; i < frames.size(); i += step) {
    for (TagDetection detection : frames[i].detections) {
      detection.corner_covariance_px2.reset();  // the same weights for both cameras
      const Result<TagPose> pose = estimate_tag_pose(detection, 1.0, camera);
      if (!pose) continue;
      misfit.px2 += pose->best.rms_px * pose->best.rms_px;
      ++misfit.tags;
    }
  }
  if (misfit.tags > 0) misfit.px2 /= static_cast<double>(misfit.tags);
  return misfit;
}

}  // namespace

void take_better_fitting_camera(RecordingSetup& setup, std::span<const TagFrame> frames) {
  if (!setup.camera || !setup.chosen.rectified || !setup.more_cameras.empty()) return;
  if (setup.metadata.contains(lap_facts::kMetadata)) return;  // Waymark does not rectify images
  constexpr std::size_t kMinTags = 10;
  constexpr double kMinRatio = 1.5;  // of the mean squares, with at least 20 degrees of freedom
  const Misfit raw = misfit_of(frames, *setup.camera);
  const Misfit rectified = misfit_of(frames, *setup.chosen.rectified);
  const bool raw_fits = raw.tags >= kMinTags;
  const bool rectified_fits = rectified.tags >= kMinTags;
  if (!raw_fits && !rectified_fits) return;
  const bool is_rectified = rectified_fits && (!raw_fits || rectified.px2 * kMinRatio < raw.px2);
  const bool is_raw = raw_fits && (!rectified_fits || raw.px2 * kMinRatio < rectified.px2);
  if (is_rectified) {
    setup.camera = setup.chosen.camera = setup.chosen.rectified;
    setup.chosen.notes.push_back(fmt::format(
        "the tags were detected in rectified images: using the projection matrix (residual of the "
        "corners {:.2f} px, but {:.2f} px with the camera matrix and the distortion)",
        rectified.rms_px(), raw.rms_px()));
  } else if (!is_raw) {
    setup.chosen.notes.push_back(fmt::format(
        "the tags may have been detected in rectified images; using the camera matrix and the "
        "distortion (residual of the corners {:.2f} px, and {:.2f} px with the projection matrix)",
        raw.rms_px(), rectified.rms_px()));
  }
  setup.chosen.rectified.reset();
}

namespace {

struct Focal {
  double fx = 0, cx = 0, cy = 0;
};

Focal focal_of(const CameraModel& camera) {
  return std::visit([](const auto& c) { return Focal{c.fx, c.cx, c.cy}; }, camera.projection());
}

}  // namespace

std::vector<std::string> disagreements(const RobotDescription& robot, const RecordingSetup& setup) {
  constexpr double kTolerance_m = 0.005;
  constexpr double kTolerance_rad = 0.5 * M_PI / 180;
  constexpr double kFocalTolerance = 0.005;  // relative to the focal length
  constexpr double kCenterTolerance_px = 3;
  std::vector<std::string> differences;
  if (setup.base_T_cam) {
    const SE3 offset = setup.base_T_cam->inverse() * robot.model.base_T_cam;
    const double offset_m = offset.translation().norm();
    const double offset_rad = offset.rotation().log().norm();
    if (offset_m > kTolerance_m || offset_rad > kTolerance_rad)
      differences.push_back(fmt::format(
          "the camera mounting in the robot file is {:.1f} cm and {:.1f} deg from that in "
          "the recording's transforms ({} to {}); using the robot file",
          100 * offset_m, to_degrees(offset_rad), setup.chosen.base_frame, setup.chosen.camera_frame));
  }
  if (!setup.camera) return differences;
  const CameraModel& recorded = *setup.camera;
  const CameraModel& described = robot.camera;
  if (recorded.width_px() != described.width_px() || recorded.height_px() != described.height_px()) {
    differences.push_back(
        fmt::format("the image size of the camera is {} x {} in the robot file and {} x {} in the "
                    "recording; using the robot file",
                    described.width_px(), described.height_px(), recorded.width_px(), recorded.height_px()));
    return differences;
  }
  const Focal a = focal_of(recorded);
  const Focal b = focal_of(described);
  if (std::abs(b.fx / a.fx - 1) > kFocalTolerance ||
      std::hypot(a.cx - b.cx, a.cy - b.cy) > kCenterTolerance_px)
    differences.push_back(fmt::format(
        "the robot file has a focal length of {:.1f} px and a principal point at ({:.1f}, {:.1f}), "
        "the recording {:.1f} px and ({:.1f}, {:.1f}); using the robot file",
        b.fx, b.cx, b.cy, a.fx, a.cx, a.cy));
  return differences;
}

Status take_robot(const std::string& robot, RecordingSetup& setup, std::vector<std::string>& warnings) {
  if (robot.empty()) return {};
  const auto path = find_shared("robots", robot, "robot");
  if (!path) return tl::unexpected(path.error());
  const auto description = or_wrong_kind(read_robot(*path), *path, FileUse::Robot);
  if (!description) return tl::unexpected(description.error());
  for (std::string& difference : disagreements(*description, setup))
    warnings.push_back(std::move(difference));
  setup.camera = description->camera;
  setup.base_T_cam = description->model.base_T_cam;
  setup.more_cameras = description->more_cameras;
  return {};
}

}  // namespace waymark
