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

/// Access to Gazebo topics, independent of the implementation. Messages are plain values with timestamps in
/// simulated time.
namespace waymark {

/// ignition.msgs.Clock.
struct GazeboClock {
  SensorTime stamp{};
};

/// ignition.msgs.Pose, or an element of ignition.msgs.Pose_V: the pose of a model, or a part of it, in the
/// world.
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

/// The value of an ignition.msgs.Odometry, IMU, LaserScan, Image, Joy, CameraInfo, Pose or Pose_V, Clock or
/// Twist.
using GazeboValue = std::variant<Odometry, ImuSample, LaserScan, CameraFrame, GamepadState, GazeboCamera,
                                 GazeboPoses, GazeboClock, StampedCommand>;

/// A topic and the type of its messages, such as "ignition.msgs.Odometry".
struct GazeboTopic {
  std::string name{};
  std::string type{};
};

struct GazeboMessage {
  std::size_t subscription = 0;  ///< number returned by subscribe()
  std::string type{};
  Result<GazeboValue> value;  ///< or the reason why it is unreadable
  Duration arrived{};         ///< time on the steady clock
};

/// A node on the Gazebo network, in the partition IGN_PARTITION at the address IGN_IP. publish() may be
/// called from a different thread than the other functions.
class GazeboLink {
 public:
  virtual ~GazeboLink() = default;
  GazeboLink(const GazeboLink&) = delete;
  GazeboLink& operator=(const GazeboLink&) = delete;

  /// Adds a subscription for messages of any type and returns its number. At most `depth` of its messages are
  /// queued.
  virtual Result<std::size_t> subscribe(const std::string& topic, int depth) = 0;
  /// Ends the subscriptions to a topic. next() may still return messages queued for them.
  virtual void unsubscribe(const std::string& topic) = 0;
  /// Adds a publisher for values of the same type as `like` and returns its number.
  virtual Result<std::size_t> advertise(const std::string& topic, const GazeboValue& like) = 0;
  virtual Status publish(std::size_t publisher, const GazeboValue& value) = 0;
  /// The oldest queued message; `nullopt` if none arrives within `timeout`.
  virtual std::optional<GazeboMessage> next(Duration timeout) = 0;
  /// Whether a publisher has a subscriber.
  [[nodiscard]] virtual bool has_subscriber(std::size_t publisher) const = 0;
  /// Topics of other programs discovered so far. May block for up to a second.
  [[nodiscard]] virtual std::vector<GazeboTopic> topics() const = 0;
  /// Addresses of the programs that publish a topic, including this one, such as "tcp://10.0.0.2:41231".
  [[nodiscard]] virtual std::vector<std::string> publishers(const std::string& topic) const = 0;
  /// A description of the partition and address that are searched.
  [[nodiscard]] virtual std::string where() const = 0;

 protected:
  GazeboLink() = default;
};

/// Type and symbol of the function that the module exports. A C function cannot return a `Result`, so it
/// stores the link or the error in its arguments.
using OpenGazeboFunction = void (*)(std::unique_ptr<GazeboLink>&, Error&);
inline constexpr const char* kOpenGazeboSymbol = "waymark_open_gazebo";

/// Joins the Gazebo network. The first call loads the module libwaymark-gazebo.so; fails if it is missing or
/// cannot be loaded.
[[nodiscard]] Result<std::unique_ptr<GazeboLink>> open_gazebo();

}  // namespace waymark
