#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/tag_names.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/recorded_lap.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/simulation/world/world.hpp"
#include "waymark/tags/tag_finder.hpp"

/// A recorded lap with the metadata that Waymark stores in recordings (docs/formats/recording.md, "Metadata
/// and attachments").
namespace waymark {

/// Names of the metadata entries in Waymark recordings.
namespace lap_facts {
inline constexpr const char* kMetadata = "waymark";
inline constexpr const char* kAnchor = "anchor";
inline constexpr const char* kAnchorPose = "map_T_anchor";
inline constexpr const char* kTagSize = "tag_size_m";
inline constexpr const char* kTagSizes = "tag_sizes_m";  ///< tags whose size differs: "tag36h11:7=0.08 …"
inline constexpr const char* kRobotFile = "robot.yaml";
inline constexpr const char* kWorldFile = "truth/world.yaml";
}  // namespace lap_facts

/// Pose of a tag at the map origin. Its z axis is the map's x axis, and its -y axis is the map's z axis.
[[nodiscard]] SE3 anchor_at_origin();

/// Values set by the caller in place of metadata that are missing or wrong in the recording.
struct SetupOverrides {
  std::optional<std::string> anchor{};  ///< "tag36h11:0", or an ID in tag36h11
  std::optional<SE3> map_T_anchor{};
  std::optional<double> tag_size_m{};
  std::map<TagId, double> size_by_tag_m{};  ///< tags whose size differs [m]
};

/// Adds the sizes to the metadata of a recording, as kTagSize and, if some tags have a different size,
/// kTagSizes.
void add_tag_sizes(const TagSizes& sizes, std::map<std::string, std::string>& facts);

/// An anchor pose in user units: x, y, z [m], followed by the roll, pitch and yaw of the tag frame [deg].
/// Fails on non-finite numbers and on positions more than 10 km from the origin.
[[nodiscard]] Result<SE3> anchor_pose_of(const std::vector<double>& numbers);

/// Creates the setup for mapping a recording. Fails if a value is specified in neither the recording nor the
/// overrides; the hint names the field. An anchor that differs from the recorded one is placed at the map
/// origin. The map's z axis is then opposite to the tag's y axis, and its x axis is along the tag's z axis.
[[nodiscard]] Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// Returns the sizes from the overrides or, if they contain none, from the recording. There is no default
/// size. Fails if the recorded sizes are invalid.
[[nodiscard]] Result<TagSizes> tag_sizes_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The world in which the recording was made, if the file contains it.
[[nodiscard]] Result<std::optional<World>> true_world(const RecordedLap& lap);

/// The robot file stored in the recording, as text; `nullopt` if there is none.
[[nodiscard]] std::optional<std::string> robot_yaml_of(const RecordedLap& lap);

/// Opens and reads a recording of any kind. If it contains only images, tags are detected in them (tag36h11
/// and the family of the recorded anchor, default settings). If a `finder` is set, the images are used even
/// if the recording contains tags, and the call fails if there are no images. Cancelling makes the call fail.
[[nodiscard]] Result<RecordedLap> read_lap_file(const std::string& path, const JobControl& control = {},
                                                const TagFinder* finder = nullptr);
/// The same for a lap in several files, such as tables, and for the camera selected by `choice`.
[[nodiscard]] Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths,
                                                 const JobControl& control, const TagFinder* finder,
                                                 const CameraChoice& choice);

/// Detections do not contain whether their images were rectified. Of the two cameras of the calibration, sets
/// `setup.camera` to the one that fits the corners clearly better, and adds a note. Does nothing unless
/// `setup.chosen.rectified` is set.
void take_better_fitting_camera(RecordingSetup& setup, std::span<const TagFrame> frames);

struct RobotDescription;

/// Differences in camera and mounting between a robot file and a recording, with one sentence for each.
[[nodiscard]] std::vector<std::string> disagreements(const RobotDescription& robot,
                                                     const RecordingSetup& setup);

/// Sets the camera and its mounting from the robot file (a path or a name), and adds a sentence to `warnings`
/// if the recording differs. Does nothing if no file is specified.
[[nodiscard]] Status take_robot(const std::string& robot, RecordingSetup& setup,
                                std::vector<std::string>& warnings);

}  // namespace waymark
