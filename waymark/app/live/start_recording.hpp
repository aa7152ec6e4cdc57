#pragma once

#include <string>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// Metadata and attachments of our recordings (docs/formats/recording.md, "Metadata and attachments").
namespace waymark {

/// The parts of a setup that are needed for teaching: camera, tag sizes, the anchor and its pose.
[[nodiscard]] TeachSetup teach_setup(const SimulatedSetup& setup);

/// Sets up a world in which only the anchor is known. The anchor is at the origin until the lap is mapped.
void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m);

/// Help of the field `durable`.
inline constexpr std::string_view kDurableHelp =
    "Sync the recording to disk every second, so that at most one second is lost in a power cut; causes more "
    "disk writes";

/// The anchor of the map for a robot process without a world file.
struct LoneAnchor {
  std::string anchor{};   ///< "tag36h11:0", or its id; empty: not given
  double tag_size_m = 0;  ///< 0: not given

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
/// Sets the anchor of a setup without a known world. Fails if it is missing in this case, or if it is given
/// for a known world.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given);
/// As above, but the default is the anchor of an existing map. Ignores an unreadable map, because the code
/// that loads it reports the error.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given, const std::string& map);

/// Fails if `images` is set but the robot has no `pictures` to record.
[[nodiscard]] Status check_recorded_images(bool pictures, const std::string& images);

/// Origin and options of a recording.
struct Making {
  std::string verb;      ///< verb of waymark
  std::string driver;    ///< source of the commands: "scripted", "pursuit"
  std::string options;   ///< its effective options, as YAML
  bool durable = false;  ///< sync every second, so that at most one second is lost in a power cut
};

/// Creates a recording that contains metadata, effective options, the robot file and, as ground truth, the
/// world file. Fails if the file exists.
[[nodiscard]] Result<SampleRecorder> start_recording(const std::string& path, const Making& making,
                                                     const RobotSetup& setup);

}  // namespace waymark
