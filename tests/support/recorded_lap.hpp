#pragma once

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/circuit_lap.hpp"
#include "tests/support/data.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// Recordings of simulated laps of circuit24, as input of jobs.
namespace waymark::test {

struct RecordedLapOptions {
  double for_s = std::numeric_limits<double>::infinity();  ///< recording ends at this time
  bool anchor_and_size = true;                             ///< records anchor and tag size
  bool odometry = true;
  bool odometry_in_transforms = false;  ///< odometry is recorded on /tf only
  double motion_ahead_s = 0;            ///< the clock of odometry and IMU is ahead of that of the camera
  double truth_ahead_s = 0;             ///< the clock of the ground truth is ahead of that of the camera
};

/// The sample, stamped by the clock of its sensor.
inline Sample stamped_by_its_clock(Sample sample, const RecordedLapOptions& options) {
  const Duration ahead(std::llround(1e9 * options.motion_ahead_s));
  const Duration truth_ahead(std::llround(1e9 * options.truth_ahead_s));
  if (auto* odometry = std::get_if<Odometry>(&sample)) odometry->stamp += ahead;
  if (auto* imu = std::get_if<ImuSample>(&sample)) imu->stamp += ahead;
  if (auto* truth = std::get_if<TruthPose>(&sample)) truth->stamp += truth_ahead;
  return sample;
}

inline Status record_transform(const Odometry& odometry, SampleRecorder& recorder) {
  return recorder.add_message(topics::kTf, odometry.stamp,
                              ros2::TFMessage{{ros2::to_ros_transform(odometry.stamp, "odom", "base_link",
                                                                      lift(odometry.odom_T_base))}});
}

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
    if (left_out) return Status();
    const Sample recorded = stamped_by_its_clock(sample, options);
    const auto* odometry = std::get_if<Odometry>(&recorded);
    return odometry != nullptr && options.odometry_in_transforms ? record_transform(*odometry, *recorder)
                                                                 : recorder->add(recorded);
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
