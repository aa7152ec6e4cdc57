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

/// A recorded lap, and what stands in our recordings beside the samples (docs/formats/recording.md, "Metadata
/// and attachments").
namespace waymark {

/// Names of what a recording of ours says of itself.
namespace lap_facts {
inline constexpr const char* kMetadata = "waymark";
inline constexpr const char* kAnchor = "anchor";
inline constexpr const char* kAnchorPose = "map_T_anchor";
inline constexpr const char* kTagSize = "tag_size_m";
inline constexpr const char* kTagSizes = "tag_sizes_m";  ///< of tags of another size: "tag36h11:7=0.08 …"
inline constexpr const char* kRobotFile = "robot.yaml";
inline constexpr const char* kWorldFile = "truth/world.yaml";
}  // namespace lap_facts

/// A tag whose centre is the origin of the map: its z is the map's x, its -y the map's z.
[[nodiscard]] SE3 anchor_at_origin();

/// What a caller knows better than the recording, or what the recording does not say.
struct SetupOverrides {
  std::optional<std::string> anchor{};  ///< "tag36h11:0", or a number of tag36h11
  std::optional<SE3> map_T_anchor{};
  std::optional<double> tag_size_m{};
  std::map<TagId, double> size_by_tag_m{};  ///< of tags of another size [m]
};

/// Sizes as metadata of a recording: kTagSize and, where some tags are of another size, kTagSizes.
void add_tag_sizes(const TagSizes& sizes, std::map<std::string, std::string>& facts);

/// "tag36h11:0", or a number of tag36h11. Errors name the field that holds the text, if there is one.
[[nodiscard]] Result<TagId> tag_named(const std::string& text, const char* field = nullptr);
/// The tags of several texts, each with one or more names between commas: "3,tag36h11:7". Errors name this
/// field.
[[nodiscard]] Result<std::vector<TagId>> tags_named(const std::vector<std::string>& texts, const char* field);

/// An anchor's pose as people write it: x, y, z [m], then roll, pitch, yaw [deg] of the tag's frame. Fails on
/// numbers that are not finite, and more than 10 km away.
[[nodiscard]] Result<SE3> anchor_pose_of(const std::vector<double>& numbers);

/// What is needed to map a recording. Fails, and says which flag helps, when neither the recording nor the
/// overrides know it. An anchor that is not the recording's stands at the origin of the map: z of the map
/// against the tag's y, x along the tag's z.
[[nodiscard]] Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The sizes that the overrides give, else the recording; without a default where neither has one. Fails on
/// recorded words that are no sizes.
[[nodiscard]] Result<TagSizes> tag_sizes_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The world a recording was made in, if it says so.
[[nodiscard]] Result<std::optional<World>> true_world(const RecordedLap& lap);

/// The robot's file in the recording, as text; nothing when there is none.
[[nodiscard]] std::optional<std::string> robot_yaml_of(const RecordedLap& lap);

/// Opens and reads a recording of any kind. Where it holds pictures only, their tags are looked for
/// (tag36h11 and the family of the recorded anchor, the usual settings). With a `finder` it is the pictures
/// that count, also where the recording holds tags, and it fails when there are none. Cancelling ends it with
/// an error.
[[nodiscard]] Result<RecordedLap> read_lap_file(const std::string& path, const JobControl& control = {},
                                                const TagFinder* finder = nullptr);
/// The same of several files of one lap (tables, say), and of the camera that `choice` names.
[[nodiscard]] Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths,
                                                 const JobControl& control, const TagFinder* finder,
                                                 const CameraChoice& choice);

struct RobotDescription;

/// Where a robot's file and a recording say different things of the camera and where it sits, in words.
[[nodiscard]] std::vector<std::string> disagreements(const RobotDescription& robot,
                                                     const RecordingSetup& setup);

/// The camera and its mounting as the robot's file (or its name) says; where the recording says otherwise, a
/// sentence is added to `warnings`. Nothing happens without a file.
[[nodiscard]] Status take_robot(const std::string& robot, RecordingSetup& setup,
                                std::vector<std::string>& warnings);

}  // namespace waymark
