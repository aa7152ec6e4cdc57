#pragma once

#include <string>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// Writes the metadata and attachments of Waymark recordings (docs/formats/recording.md, "Metadata and
/// attachments").
namespace waymark {

/// The parts of a setup that are needed for teaching: camera, tag sizes, anchor, and its pose.
[[nodiscard]] TeachSetup teach_setup(const SimulatedSetup& setup);

/// Sets up a world in which only the anchor is known, and lies at the origin until the lap is mapped.
void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m);

/// Help for the field `durable`.
inline constexpr std::string_view kDurableHelp =
    "Sync the recording to disk every second, so that at most one second is lost in a power cut; causes more "
    "disk writes";

/// The anchor of the map for a robot process without a world file.
struct LoneAnchor {
  std::string anchor{};   ///< "tag36h11:0", or an ID; empty if not specified
  double tag_size_m = 0;  ///< tag size; 0 if not specified

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.anchor, JobField("anchor TAG",
                                "With `robot=process`: anchor tag of the map, for example tag36h11:0, or its "
                                "id. It must be in view at the start and at the end of the lap"));
    visit(self.tag_size_m,
          JobField("tag_size_m FLOAT", "With `robot=process`: side of the black square of the tags", 0.001,
                   10.0));
  }
};
/// Sets the anchor in a setup without a known world. Fails if the anchor is not specified in this case, or if
/// it is specified although the world is known.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given);
/// The same, except that the anchor defaults to that of an existing map. An unreadable map is ignored,
/// because the code that loads it will report the error.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given, const std::string& map);

/// Fails if `images` is set but the robot sends no images (`has_images`) that could be recorded.
[[nodiscard]] Status check_recorded_images(bool has_images, const std::string& images);

/// How a recording was made, and with which options.
struct Making {
  std::string verb;      ///< the verb of waymark that makes the recording
  std::string driver;    ///< source of the commands: "scripted", "pursuit"
  std::string options;   ///< effective options, as YAML
  bool durable = false;  ///< whether to sync every second, so that a power cut loses at most one second
};

/// Creates a recording with metadata, effective options, the robot file and, as ground truth, the world file.
/// Fails if the file already exists.
[[nodiscard]] Result<SampleRecorder> start_recording(const std::string& path, const Making& making,
                                                     const RobotSetup& setup);

}  // namespace waymark
