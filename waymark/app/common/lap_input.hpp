#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/recorded_lap.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/simulation/world/world.hpp"
#include "waymark/tags/tag_finder.hpp"

/// A recorded lap, with the metadata of Waymark's recordings (docs/formats/recording.md, "Metadata
/// and attachments").
namespace waymark {

/// Names of the metadata in a Waymark recording.
namespace lap_facts {
inline constexpr const char* kMetadata = "waymark";
inline constexpr const char* kAnchor = "anchor";
inline constexpr const char* kAnchorPose = "map_T_anchor";
inline constexpr const char* kTagSize = "tag_size_m";
inline constexpr const char* kTagSizes = "tag_sizes_m";  ///< of tags of another size: "tag36h11:7=0.08 …"
inline constexpr const char* kRobotFile = "robot.yaml";
inline constexpr const char* kWorldFile = "truth/world.yaml";
}  // namespace lap_facts

/// Pose of a tag at the map origin: its z is the map's x, its -y the map's z.
[[nodiscard]] SE3 anchor_at_origin();

/// The caller's overrides for metadata that are missing or wrong in the recording.
struct SetupOverrides {
  std::optional<std::string> anchor{};  ///< "tag36h11:0", or a number of tag36h11
  std::optional<SE3> map_T_anchor{};
  std::optional<double> tag_size_m{};
  std::map<TagId, double> size_by_tag_m{};  ///< of tags of another size [m]
};

/// Sizes as metadata of a recording: kTagSize, and kTagSizes if some tags have another size.
void add_tag_sizes(const TagSizes& sizes, std::map<std::string, std::string>& facts);

/// "tag36h11:0", or a number of tag36h11. Errors name the field that holds the text, if there is one.
[[nodiscard]] Result<TagId> tag_named(const std::string& text, const char* field = nullptr);
/// The tags of several texts, each a comma-separated list: "3,tag36h11:7". Errors name this field.
[[nodiscard]] Result<std::vector<TagId>> tags_named(const std::vector<std::string>& texts, const char* field);

/// An anchor pose in user units: x, y, z [m], then roll, pitch, yaw [deg] of the tag frame. Fails on
/// non-finite numbers and on positions more than 10 km from the origin.
[[nodiscard]] Result<SE3> anchor_pose_of(const std::vector<double>& numbers);

/// Setup for mapping a recording. Fails, with a hint that names the field, if neither the recording nor the
/// overrides contain a value. An anchor other than the recording's is at the map origin, with the map's z
/// opposite to the tag's y and its x along the tag's z.
[[nodiscard]] Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The sizes from the overrides, else from the recording; no default size if neither contains one. Fails on
/// invalid recorded sizes.
[[nodiscard]] Result<TagSizes> tag_sizes_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The world of the recording, if it is recorded.
[[nodiscard]] Result<std::optional<World>> true_world(const RecordedLap& lap);

/// The robot file in the recording, as text; nothing if there is none.
[[nodiscard]] std::optional<std::string> robot_yaml_of(const RecordedLap& lap);

/// Opens and reads a recording of any kind. If it contains only images, their tags are detected
/// (tag36h11 and the family of the recorded anchor, default settings). With a `finder`, the images are used
/// even if the recording contains tags, and the call fails without images. Cancelling ends it with an error.
[[nodiscard]] Result<RecordedLap> read_lap_file(const std::string& path, const JobControl& control = {},
                                                const TagFinder* finder = nullptr);
/// The same for several files of one lap, such as tables, and for the camera named by `choice`.
[[nodiscard]] Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths,
                                                 const JobControl& control, const TagFinder* finder,
                                                 const CameraChoice& choice);

struct RobotDescription;

/// Differences of camera and mounting between a robot file and a recording, one sentence each.
[[nodiscard]] std::vector<std::string> disagreements(const RobotDescription& robot,
                                                     const RecordingSetup& setup);

/// Sets camera and mounting from the robot file (or its name), and adds a sentence to `warnings` if the
/// recording differs. Does nothing without a file.
[[nodiscard]] Status take_robot(const std::string& robot, RecordingSetup& setup,
                                std::vector<std::string>& warnings);

}  // namespace waymark
