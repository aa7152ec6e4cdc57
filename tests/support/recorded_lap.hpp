#pragma once

#include <filesystem>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/circuit_lap.hpp"
#include "tests/support/data.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// Recordings of simulated laps of circuit24, as input of jobs.
namespace waymark::test {

struct RecordedLapOptions {
  double for_s = std::numeric_limits<double>::infinity();  ///< recording ends at this time
  bool anchor_and_size = true;                             ///< records anchor and tag size
  bool odometry = true;
};

inline std::string file_text(const std::filesystem::path& path) {
  return read_text_file(path, std::size_t{1} << 26U).value_or("cannot be read: " + path.string());
}

inline std::string seven_numbers(const SE3& pose) {
  std::string text;
  const Eigen::Vector3d& p = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation().quaternion();
  for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()})
    text += (text.empty() ? "" : " ") + fmt::format("{}", value);
  return text;
}

/// Drives a lap and records it with truth, world and robot; returns the path of the file.
inline std::string record_lap(const std::filesystem::path& file, std::uint64_t seed,
                              const RecordedLapOptions& options = {}) {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const World& world = circuit();
  auto sink = create_file(file);
  EXPECT_TRUE(sink);
  auto recorder = SampleRecorder::open(std::move(*sink));
  EXPECT_TRUE(recorder);
  const MappedTag& anchor = *world.tags.find(world.anchor);
  if (options.anchor_and_size) {
    EXPECT_TRUE(recorder->add_metadata(lap_facts::kMetadata,
                                       {{lap_facts::kAnchor, to_string(world.anchor)},
                                        {lap_facts::kTagSize, fmt::format("{}", anchor.size_m)},
                                        {lap_facts::kAnchorPose, seven_numbers(anchor.map_T_tag)}}));
  }
  EXPECT_TRUE(recorder->add_attachment(lap_facts::kRobotFile, "application/yaml", {},
                                       file_text(WAYMARK_SHARE "/robots/limo.yaml")));
  EXPECT_TRUE(recorder->add_attachment(lap_facts::kWorldFile, "application/yaml", {},
                                       file_text(WAYMARK_SHARE "/worlds/circuit24.yaml")));
  recorder->add_cameras_with_first_sample({{.camera = robot.camera, .base_T_cam = robot.model.base_T_cam}});
  LapListener listener;
  bool over = false;
  listener.on_sample = [&](const Sample& sample) {
    over = over || to_seconds(stamp_of(sample).time_since_epoch()) > options.for_s;
    const bool left_out = over || (!options.odometry && std::holds_alternative<Odometry>(sample));
    return left_out ? Status() : recorder->add(sample);
  };
  listener.should_stop = [&] { return over; };
  EXPECT_TRUE(drive_scripted_lap({world, robot.model, robot.camera, {.seed = seed}}, {}, listener));
  EXPECT_TRUE(recorder->close());
  return file.string();
}

/// Sorted names of the files in a folder.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none))
    names.push_back(entry.path().filename().string());
  std::ranges::sort(names);
  return names;
}

/// A control that cancels after being asked this many times.
inline JobControl cancelled_after(int questions) {
  JobControl control;
  control.cancelled = [questions]() mutable { return questions-- <= 0; };
  return control;
}

}  // namespace waymark::test
