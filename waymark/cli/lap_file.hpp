#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/cli/stage_flags.hpp"
#include "waymark/cli/tag_finder.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/recorded_lap.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// What stands in our recordings beside the samples (docs/formats/recording.md, "Metadata and attachments").
namespace waymark::cli {

/// What the teach phase knows of a stage: camera, tags' sizes, the anchor and its pose.
[[nodiscard]] TeachSetup teach_setup(const SimulatedStage& stage);

/// For a world of which only the anchor is known: it stands at the origin until the lap is mapped.
void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m);

/// How a recording comes to be.
struct Making {
  std::string verb;      ///< of waymark
  std::string driver;    ///< what decided the commands: "scripted", "pursuit"
  std::string options;   ///< its effective options, as YAML
  bool durable = false;  ///< sync each second, so that a power cut loses no more
};

/// A new recording that says how it was made: metadata, effective options, the robot's file, and, as truth,
/// the world's. Fails when the file exists.
[[nodiscard]] Result<SampleRecorder> start_recording(const std::string& path, const Making& making,
                                                     const Stage& stage);

/// What a caller knows better than the recording, or what the recording does not say.
struct SetupOverrides {
  std::optional<std::string> anchor{};  ///< "tag36h11:0", or a number of tag36h11
  std::optional<SE3> map_T_anchor{};
  std::optional<double> tag_size_m{};
};

/// "tag36h11:0", or a number of tag36h11.
[[nodiscard]] Result<TagId> tag_named(const std::string& text);

/// What is needed to map a recording. Fails, and says which flag helps, when neither the recording nor the
/// overrides know it. An anchor that is not the recording's stands at the origin of the map: z of the map
/// against the tag's y, x along the tag's z.
[[nodiscard]] Result<TeachSetup> setup_of(const RecordedLap& lap, const SetupOverrides& overrides);

/// The world a recording was made in, if it says so.
[[nodiscard]] Result<std::optional<World>> true_world(const RecordedLap& lap);

/// The robot's file in the recording, as text; nothing when there is none.
[[nodiscard]] std::optional<std::string> robot_yaml_of(const RecordedLap& lap);

/// Opens and reads a recording of any kind. Where it holds pictures only, their tags are looked for
/// (tag36h11, the usual settings), and `console` hears how far that is. With a `finder` it is the pictures
/// that count, also where the recording holds tags, and it fails when there are none. Ctrl-C ends it with an
/// error.
[[nodiscard]] Result<RecordedLap> read_lap_file(const std::string& path, Console* console = nullptr,
                                                const TagFinder* finder = nullptr);
/// The same of several files of one lap (tables, say), and of the camera that `choice` names.
[[nodiscard]] Result<RecordedLap> read_lap_files(const std::vector<std::string>& paths, Console* console,
                                                 const TagFinder* finder, const CameraChoice& choice);

}  // namespace waymark::cli
