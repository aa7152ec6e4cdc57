#include "waymark/cli/lap_file.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/log_options.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/tags/apriltag_detector.hpp"

#ifndef WAYMARK_VERSION
#define WAYMARK_VERSION "unknown"
#endif

namespace waymark::cli {
namespace {

constexpr const char* kMetadata = "waymark";
constexpr const char* kRobotFile = "robot.yaml";
constexpr const char* kWorldFile = "truth/world.yaml";
constexpr const char* kOptionsFile = "options.yaml";
constexpr const char* kYaml = "application/yaml";

std::string text_of(const SE3& a_T_b) {
  const Eigen::Vector3d& p = a_T_b.translation();
  const Eigen::Quaterniond& q = a_T_b.rotation().quaternion();
  return fmt::format("{} {} {} {} {} {} {}", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

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
  if (n.size() != 7) return fail(ErrorCode::Unreadable, "the pose of the anchor is not seven numbers");
  const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(n[6], n[3], n[4], n[5]));
  if (!rotation) return tl::unexpected(rotation.error());
  return SE3(*rotation, {n[0], n[1], n[2]});
}

/// The effective options of everything that made the recording.
std::string options_yaml(const SimulatedRobotOptions& robot) { return "robot:\n" + write_fields(robot, 2); }

/// The tag's z is the map's x, its -y the map's z.
SE3 anchor_at_origin() {
  return {SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
          Eigen::Vector3d::Zero()};
}

std::optional<std::string> metadata(const RecordedLap& lap, const std::string& key) {
  const auto block = lap.setup.metadata.find(kMetadata);
  if (block == lap.setup.metadata.end()) return std::nullopt;
  const auto value = block->second.find(key);
  return value == block->second.end() ? std::nullopt : std::optional(value->second);
}

Status fill_anchor(const RecordedLap& lap, const SetupOverrides& overrides, TeachSetup& setup) {
  const std::optional<std::string> recorded = metadata(lap, "anchor");
  if (!recorded && !overrides.anchor)
    return fail(ErrorCode::NotFound, "the recording does not say which tag is the anchor", {},
                "Give --anchor with a tag that was seen, for example --anchor tag36h11:0.");
  const Result<TagId> anchor = tag_named(overrides.anchor.value_or(recorded.value_or("")));
  if (!anchor) return tl::unexpected(anchor.error());
  setup.anchor = *anchor;
  setup.map_T_anchor = overrides.map_T_anchor.value_or(anchor_at_origin());
  if (overrides.map_T_anchor) return {};
  const std::optional<std::string> pose = metadata(lap, "map_T_anchor");
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

Result<TagId> tag_named(const std::string& text) {
  const bool only_digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  return parse_tag_id(only_digits ? "tag36h11:" + text : text);
}

void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m) {
  world.anchor = anchor;
  world.tags.tags[anchor] = {.map_T_tag = anchor_at_origin(), .size_m = tag_size_m};
}

TeachSetup teach_setup(const SimulatedStage& stage) {
  const World& world = stage.world;
  TeachSetup setup{.camera = stage.camera,
                   .base_T_cam = stage.model.base_T_cam,
                   .anchor = world.anchor,
                   .map_T_anchor = world.tags.find(world.anchor)->map_T_tag,
                   .closed_route = world.path_closed};
  for (const auto& [tag, mapped] : world.tags.tags) setup.sizes.size_by_tag_m[tag] = mapped.size_m;
  setup.sizes.default_size_m = world.tags.find(world.anchor)->size_m;
  return setup;
}

Result<SampleRecorder> start_recording(const std::string& path, const Making& making, const Stage& stage) {
  auto file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  Result<SampleRecorder> recorder = SampleRecorder::open(
      std::move(*file), {.library = "waymark " WAYMARK_VERSION, .durable = making.durable});
  if (!recorder) return recorder;
  const SimulatedStage& simulated = stage.simulated;
  if (stage.process.empty())
    recorder->set_camera_latency(Duration(std::llround(simulated.robot.camera_latency_s * 1e9)));
  const TeachSetup setup = teach_setup(simulated);
  std::map<std::string, std::string> facts = {
      {"verb", making.verb},
      {"version", WAYMARK_VERSION},
      {"robot", simulated.model.name},
      {"driver", making.driver},
      {"source", stage.process.empty() ? "sim" : "process:" + stage.process.text()},
      {"anchor", to_string(setup.anchor)},
      {"tag_size_m", fmt::format("{}", *setup.sizes.default_size_m)}};
  if (stage.process.empty()) facts["seed"] = std::to_string(simulated.robot.seed);
  if (!stage.world_yaml.empty()) {
    facts["world"] = simulated.world.name;
    facts["map_T_anchor"] = text_of(setup.map_T_anchor);
  }
  Status status = recorder->add_metadata(kMetadata, facts);
  if (status) status = recorder->add_attachment(kRobotFile, kYaml, {}, stage.robot_yaml);
  if (status && !stage.world_yaml.empty())
    status = recorder->add_attachment(kWorldFile, kYaml, {}, stage.world_yaml);
  if (status)
    status =
        recorder->add_attachment(kOptionsFile, kYaml, {}, options_yaml(simulated.robot) + making.options);
  if (!status) return tl::unexpected(status.error());
  recorder->add_camera_with_first_sample(simulated.camera, simulated.model.base_T_cam);
  return recorder;
}

Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides) {
  if (!lap.setup.camera && lap.setup.chosen.camera_error)
    return tl::unexpected(*lap.setup.chosen.camera_error);
  if (!lap.setup.camera) {
    std::string message = "the recording holds no calibration of its camera (/camera_info)";
    if (!lap.setup.problems.empty())  // cut too early, perhaps
      message += fmt::format(", and this was found in it: {}", to_string(lap.setup.problems.front()));
    return fail(ErrorCode::NotFound, std::move(message), {},
                "Give a robot's file with --robot, or record sensor_msgs/CameraInfo with it; a table or bag "
                "of detections "
                "alone can be mapped with `waymark map --tagslam FOLDER`, where TagSLAM's files describe the "
                "cameras and "
                "the tags' sizes. "
                "`waymark info` shows what it holds.");
  }
  if (!lap.setup.base_T_cam && lap.setup.chosen.mounting_error) {
    Error error = *lap.setup.chosen.mounting_error;
    error.message = "the recording does not say where the camera sits: " + error.message;
    return tl::unexpected(std::move(error));
  }
  if (!lap.setup.base_T_cam)
    return fail(
        ErrorCode::NotFound,
        "the recording does not say where the camera sits: it has no transforms (/tf_static, /tf) from the "
        "base to the camera's optical frame",
        {}, "Give a robot's file with --robot. `waymark info` shows what it holds.");
  TeachSetup setup{.camera = *lap.setup.camera, .base_T_cam = *lap.setup.base_T_cam};
  const std::optional<std::string> recorded = metadata(lap, "tag_size_m");
  const auto size = overrides.tag_size_m ? overrides.tag_size_m : parse_number(recorded.value_or(""));
  if (!size)
    return fail(ErrorCode::NotFound, "the recording does not say how large its tags are", {},
                "Give --tag-size-m, the side of the black square.");
  setup.sizes.default_size_m = *size;
  if (Status status = setup.sizes.check(); !status) return tl::unexpected(status.error());
  if (Status status = fill_anchor(lap, overrides, setup); !status) return tl::unexpected(status.error());
  return setup;
}

Result<std::optional<World>> true_world(const RecordedLap& lap) {
  const auto text = lap.attachments.find(kWorldFile);
  if (text == lap.attachments.end()) return std::optional<World>();
  Result<World> world = parse_world(text->second, kWorldFile);
  if (!world) return tl::unexpected(world.error());
  return std::optional(std::move(*world));
}

std::optional<std::string> robot_yaml_of(const RecordedLap& lap) {
  const auto text = lap.attachments.find(kRobotFile);
  return text == lap.attachments.end() ? std::nullopt : std::optional(text->second);
}

Result<RecordedLap> read_lap_file(const std::string& path, Console* console, const TagFinder* finder) {
  return read_lap_files({path}, console, finder, {});
}

Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths, Console* console,
                                   const TagFinder* finder, const CameraChoice& choice) {
  const auto log = open_logs(paths, until_interrupted());
  if (!log) return tl::unexpected(log.error());
  std::optional<TagFinder> usual;  // made when it is needed
  const FrameFinder find = [&](const CameraFrame& picture, const CameraModel* camera) -> Result<TagFrame> {
    if (interrupted())
      return fail(ErrorCode::Unreadable, "stopped before its tags were found", {.source = paths.front()});
    if (finder == nullptr && !usual) {
      auto detector = make_apriltag_detector({});
      if (!detector) return tl::unexpected(detector.error());
      usual = TagFinder{.detector = std::move(*detector), .refinement = RefinementOptions{}};
    }
    Result<FoundTags> found = find_tags(picture.image, finder != nullptr ? *finder : *usual, camera);
    if (!found) return tl::unexpected(found.error());
    if (console != nullptr)
      console->live(fmt::format("finding tags: {:.1f} s", to_seconds(picture.stamp.time_since_epoch())));
    return TagFrame{picture.stamp, picture.camera, std::move(found->detections)};
  };
  Result<RecordedLap> lap =
      read_lap(**log, find, finder != nullptr ? TagSource::Pictures : TagSource::AsRecorded, choice);
  if (lap && console != nullptr)
    for (const std::string& note : lap->setup.chosen.notes) console->say("note: " + note);
  return lap;
}

}  // namespace waymark::cli
