#include "waymark/app/live/start_recording.hpp"

#include <cmath>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml_fields.hpp"

#ifndef WAYMARK_VERSION
#define WAYMARK_VERSION "unknown"
#endif

namespace waymark {
namespace {

constexpr const char* kOptionsFile = "options.yaml";
constexpr const char* kYaml = "application/yaml";

std::string text_of(const SE3& a_T_b) {
  const Eigen::Vector3d& p = a_T_b.translation();
  const Eigen::Quaterniond& q = a_T_b.rotation().quaternion();
  return fmt::format("{} {} {} {} {} {} {}", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

/// The attachment that contains the effective options of the job.
std::string options_yaml(const SimulatedRobotOptions& robot) { return "robot:\n" + write_fields(robot, 2); }

}  // namespace

void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m) {
  world.anchor = anchor;
  world.tags.tags[anchor] = {.map_T_tag = anchor_at_origin(), .size_m = tag_size_m};
}

Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given) {
  if (setup.process.empty() || !setup.world_yaml.empty()) {
    if (given.anchor.empty() && given.tag_size_m == 0) return {};
    return fail(ErrorCode::InvalidArgument, "the world file already specifies the tags",
                {.key = given.anchor.empty() ? "tag_size_m" : "anchor"},
                "Omit this option, or omit `world`.");
  }
  if (given.anchor.empty() || given.tag_size_m == 0)
    return fail(ErrorCode::InvalidArgument, "anchor and tag size are not given",
                {.key = given.anchor.empty() ? "anchor" : "tag_size_m"},
                "For example `anchor=0` `tag_size_m=0.16`.");
  const auto anchor = tag_named(given.anchor, "anchor");
  if (!anchor) return tl::unexpected(anchor.error());
  place_lone_anchor(setup.simulated.world, *anchor, given.tag_size_m);
  return {};
}

Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given, const std::string& map) {
  const bool is_given = !given.anchor.empty() || given.tag_size_m != 0;
  if (map.empty() || !setup.world_yaml.empty() || is_given) return place_lone_anchor(setup, given);
  const Result<MapFile> file = read_map(std::filesystem::path(map) / "map.yaml");
  if (file) place_lone_anchor(setup.simulated.world, file->anchor, file->tags.tags.at(file->anchor).size_m);
  return {};
}

Status check_recorded_images(bool has_images, const std::string& images) {
  if (has_images || images.empty()) return {};
  return fail(ErrorCode::InvalidArgument, "there are no images to record", {.key = "record_images"},
              "Add `images`.");
}

TeachSetup teach_setup(const SimulatedSetup& simulated) {
  const World& world = simulated.world;
  TeachSetup setup{.camera = simulated.camera,
                   .base_T_cam = simulated.model.base_T_cam,
                   .anchor = world.anchor,
                   .map_T_anchor = world.tags.find(world.anchor)->map_T_tag,
                   .closed_route = world.path_closed,
                   .hull = simulated.model.hull,
                   .more_cameras = simulated.more_cameras};
  for (const auto& [tag, mapped] : world.tags.tags) setup.sizes.size_by_tag_m[tag] = mapped.size_m;
  setup.sizes.default_size_m = world.tags.find(world.anchor)->size_m;
  return setup;
}

Result<SampleRecorder> start_recording(const std::string& path, const Making& making,
                                       const RobotSetup& setup) {
  auto file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  Result<SampleRecorder> recorder = SampleRecorder::open(
      std::move(*file), {.library = "waymark " WAYMARK_VERSION, .durable = making.durable});
  if (!recorder) return recorder;
  const SimulatedSetup& simulated = setup.simulated;
  if (setup.process.empty())
    recorder->set_image_arrival_delay(Duration(std::llround(simulated.robot.camera_latency_s * 1e9)));
  const TeachSetup lap = teach_setup(simulated);
  std::map<std::string, std::string> facts = {
      {"verb", making.verb},
      {"version", WAYMARK_VERSION},
      {"robot", simulated.model.name},
      {"driver", making.driver},
      {"source", setup.process.empty() ? "sim" : "process:" + setup.process.text()},
      {lap_facts::kAnchor, to_string(lap.anchor)}};
  add_tag_sizes(lap.sizes, facts);
  if (setup.process.empty()) facts["seed"] = std::to_string(simulated.robot.seed);
  if (!setup.world_yaml.empty()) {
    facts["world"] = simulated.world.name;
    facts[lap_facts::kAnchorPose] = text_of(lap.map_T_anchor);
  }
  Status status = recorder->add_metadata(lap_facts::kMetadata, facts);
  if (status) status = recorder->add_attachment(lap_facts::kRobotFile, kYaml, {}, setup.robot_yaml);
  if (status && !setup.world_yaml.empty())
    status = recorder->add_attachment(lap_facts::kWorldFile, kYaml, {}, setup.world_yaml);
  if (status)
    status =
        recorder->add_attachment(kOptionsFile, kYaml, {}, options_yaml(simulated.robot) + making.options);
  if (!status) return tl::unexpected(status.error());
  recorder->add_cameras_with_first_sample(simulated.cameras());
  return recorder;
}

}  // namespace waymark
