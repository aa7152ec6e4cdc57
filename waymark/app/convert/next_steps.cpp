#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/convert/recording_info.hpp"

namespace waymark {
namespace {

/// What a map of the tags needs and the recording does not say, as flags or words.
struct MapNeeds {
  std::vector<std::string> flags{};    ///< can be given
  std::vector<std::string> missing{};  ///< cannot
};

/// Whether the recording itself names it: "anchor", "tag_size_m".
bool says(const RecordingInfo& info, const char* key) {
  const auto block = info.setup.metadata.find("waymark");
  return block != info.setup.metadata.end() && block->second.contains(key);
}

MapNeeds map_needs(const RecordingInfo& info) {
  MapNeeds needs;
  if (!says(info, "anchor")) needs.flags.emplace_back("--anchor tag36h11:0");
  if (!says(info, "tag_size_m")) needs.flags.emplace_back("--tag-size-m 0.16");
  if (!info.setup.camera || !info.setup.base_T_cam) needs.flags.emplace_back("--robot robot.yaml");
  if (info.setup.chosen.ambiguous) needs.flags.emplace_back("--camera-topic TOPIC");
  if (!info.setup.camera) needs.missing.emplace_back("a calibration of its camera (sensor_msgs/CameraInfo)");
  if (!info.setup.base_T_cam)
    needs.missing.emplace_back(
        "where the camera sits (/tf_static, from the base to the camera's optical frame)");
  return needs;
}

NextStep map_step(const RecordingInfo& info) {
  const MapNeeds needs = map_needs(info);
  const bool detects = !info.contents.contains("tags");
  if (!needs.missing.empty()) {
    return {fmt::format("Make a map of the tags: the robot's file says what the recording lacks, {}.",
                        fmt::join(needs.missing, " and ")),
            fmt::format("waymark map {} {} -o map", shell_word(info.file), fmt::join(needs.flags, " "))};
  }
  return {detects ? "Find the tags in its pictures and make a map of them." : "Make a map of the tags.",
          fmt::format("waymark map {}{}{} -o map", shell_word(info.file), needs.flags.empty() ? "" : " ",
                      fmt::join(needs.flags, " "))};
}

/// A new file in the folder one stands in: beside the recording it may not be allowed.
std::string here(const RecordingInfo& info, const char* suffix) {
  return shell_word(std::filesystem::path(info.file).filename().string() + suffix);
}

std::string recover_command(const RecordingInfo& info) {
  const std::filesystem::path path(info.file);
  if (!path.has_parent_path()) return "waymark recover " + shell_word(info.file);
  return fmt::format("waymark recover {} -o {}", shell_word(info.file),
                     shell_word(path.stem().string() + ".recovered.mcap"));
}

}  // namespace

std::vector<NextStep> next_steps(const RecordingInfo& info) {
  std::vector<NextStep> steps;
  const auto has = [&](const char* kind) { return info.contents.contains(kind); };
  if (info.format == LogFormat::Mcap && !info.summary.complete)
    steps.push_back({"Give it the index it lost.", recover_command(info)});
  if (info.format != LogFormat::Mcap && !info.contents.empty())
    steps.push_back({"Make an MCAP recording of it, which opens quickly and in every tool.",
                     fmt::format("waymark convert {} {}", shell_word(info.file), here(info, ".mcap"))});
  if (has("pictures"))
    steps.push_back({"Find the tags in its pictures.", "waymark detect " + shell_word(info.file)});
  const bool moves = has("odometry");
  const bool corners = has("tags") || has("pictures");
  if (corners && moves) {
    steps.push_back(map_step(info));
  } else if (corners) {
    const std::vector<std::string> missing = map_needs(info).missing;
    steps.push_back(
        {fmt::format("A map of a lap needs odometry too: give it as a further file.{}",
                     missing.empty() ? ""
                                     : fmt::format(" The robot's file says what it lacks besides, {}.",
                                                   fmt::join(missing, " and "))),
         fmt::format("waymark map {} odometry.csv --robot robot.yaml --tag-size-m 0.16 --anchor "
                     "tag36h11:0 -o map",
                     shell_word(info.file))});
  } else if (moves && has("tag_poses")) {
    steps.push_back({"Make a map of the tags from the poses its robot gave them.",
                     fmt::format("waymark map {}{} -o map", shell_word(info.file),
                                 says(info, "tag_size_m")        ? ""
                                 : info.format == LogFormat::Lcm ? " --tag-size-m 0.054"  // an MBot's
                                                                 : " --tag-size-m 0.16")});
  }
  const char* robot = corners && !(info.setup.camera && info.setup.base_T_cam) ? " --robot robot.yaml" : "";
  if (moves && (corners || has("tag_poses") || has("range_bearing"))) {
    steps.push_back({"Localise it in a map of what it saw.",
                     fmt::format("waymark localize {} --map map{}", shell_word(info.file), robot)});
  } else if (has("odometry") || has("imu")) {
    steps.push_back({"Localise with it: give what was seen on the same drive as a further file.",
                     fmt::format("waymark localize {} detections.csv --map map", shell_word(info.file))});
  }
  if (!info.contents.empty())
    steps.push_back({"Watch what it says, as it was said.", "waymark play " + shell_word(info.file)});
  if (info.contents.empty() && info.report.messages > 0)
    steps.push_back({"None of its messages are of a kind that Waymark uses.",
                     "waymark play --messages " + shell_word(info.file)});
  return steps;
}

}  // namespace waymark
