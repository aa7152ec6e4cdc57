#pragma once

#include <string>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"

/// What stands in our recordings beside the samples (docs/formats/recording.md, "Metadata and attachments").
namespace waymark {

/// What the teach phase knows of a setup: camera, tags' sizes, the anchor and its pose.
[[nodiscard]] TeachSetup teach_setup(const SimulatedSetup& setup);

/// For a world of which only the anchor is known: it stands at the origin until the lap is mapped.
void place_lone_anchor(World& world, const TagId& anchor, double tag_size_m);

/// What the map of a robot that is a process will stand on, where no file of a world says it.
/// Of the field `durable` of what records.
inline constexpr std::string_view kDurableHelp =
    "Sync the recording each second: a power cut loses no more than that, at the price of a busy disk";

struct LoneAnchor {
  std::string anchor{};   ///< "tag36h11:0", or its id; empty: not given
  double tag_size_m = 0;  ///< 0: not given

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.anchor, JobField("anchor TAG",
                                "Anchor tag of the map with `robot=process`, for example tag36h11:0, or its "
                                "id; it must be in view where the lap begins and ends"));
    visit(self.tag_size_m,
          JobField("tag_size_m FLOAT", "With `robot=process`: side of the tags' black squares", 0.001, 10.0));
  }
};
/// Gives the setup an anchor where its world is not known. Fails when it must be given and is not, and the
/// other way round.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given);
/// The same where a map is there already, whose anchor it is unless one is given. What is wrong with that map
/// is said where it is read.
[[nodiscard]] Status place_lone_anchor(RobotSetup& setup, const LoneAnchor& given, const std::string& map);

/// Fails where `images` says how pictures are recorded, and the robot has no `pictures`.
[[nodiscard]] Status check_recorded_images(bool pictures, const std::string& images);

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
                                                     const RobotSetup& setup);

}  // namespace waymark
