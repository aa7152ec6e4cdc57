#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_samples.hpp"

/// The topics of Gazebo, whatever implements them. Messages are plain values; their stamps are simulated
/// time.
namespace waymark {

/// ignition.msgs.Clock.
struct GazeboClock {
  SensorTime stamp{};
};

/// ignition.msgs.Pose, or one of ignition.msgs.Pose_V: a model, or a part of it, in the world.
struct GazeboPose {
  std::string name{};
  SE3 world_T_model{};
};
struct GazeboPoses {
  SensorTime stamp{};
  std::vector<GazeboPose> poses{};
};

/// ignition.msgs.CameraInfo.
struct GazeboCamera {
  SensorTime stamp{};
  CameraModel camera;
};

/// Of ignition.msgs.Odometry, IMU, LaserScan, Image, Joy, CameraInfo, Pose or Pose_V, Clock, Twist.
using GazeboValue = std::variant<Odometry, ImuSample, LaserScan, CameraFrame, GamepadState, GazeboCamera,
                                 GazeboPoses, GazeboClock, StampedCommand>;

/// A topic and the type of its messages: "ignition.msgs.Odometry".
struct GazeboTopic {
  std::string name{};
  std::string type{};
};

struct GazeboMessage {
  std::size_t subscription = 0;  ///< as subscribe() numbered it
  std::string type{};
  Result<GazeboValue> value;  ///< or why it cannot be read
  Duration arrived{};         ///< steady clock
};

/// A node on the network of Gazebo: of the partition and the address that IGN_PARTITION and IGN_IP name.
/// publish() may be called from another thread than all else.
class GazeboLink {
 public:
  virtual ~GazeboLink() = default;
  GazeboLink(const GazeboLink&) = delete;
  GazeboLink& operator=(const GazeboLink&) = delete;

  /// The number of a new subscription, of any type, of which at most `depth` messages wait to be taken.
  virtual Result<std::size_t> subscribe(const std::string& topic, int depth) = 0;
  /// Ends the subscriptions of a topic; what waits of them may still come.
  virtual void unsubscribe(const std::string& topic) = 0;
  /// The number of a new publisher, of the type of such values.
  virtual Result<std::size_t> advertise(const std::string& topic, const GazeboValue& like) = 0;
  virtual Status publish(std::size_t publisher, const GazeboValue& value) = 0;
  /// The oldest message that waits; nothing: none came within `most`.
  virtual std::optional<GazeboMessage> next(Duration most) = 0;
  /// Whether somebody subscribes to what a publisher sends.
  [[nodiscard]] virtual bool heard(std::size_t publisher) const = 0;
  /// What others publish, as far as it was discovered. May wait for a second.
  [[nodiscard]] virtual std::vector<GazeboTopic> topics() const = 0;
  /// Addresses of the programs that publish a topic, this one included: "tcp://10.0.0.2:41231".
  [[nodiscard]] virtual std::vector<std::string> publishers(const std::string& topic) const = 0;
  /// Where it looks: partition and address, in words.
  [[nodiscard]] virtual std::string where() const = 0;

 protected:
  GazeboLink() = default;
};

/// The function that the module exports, and its name there. `Result` crosses no border of C: the link, or
/// the error, is put where the arguments say.
using OpenGazeboFunction = void (*)(std::unique_ptr<GazeboLink>&, Error&);
inline constexpr const char* kOpenGazeboSymbol = "waymark_open_gazebo";

/// Joins the network of Gazebo. The module libwaymark-gazebo.so is loaded by the first call; fails where it
/// is not there or cannot be loaded.
[[nodiscard]] Result<std::unique_ptr<GazeboLink>> open_gazebo();

}  // namespace waymark
