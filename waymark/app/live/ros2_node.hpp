#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/frame_tree.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/ros2/profile.hpp"
#include "waymark/robots/ros2/trigger_service.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// Data about the robot that a Ros2Node needs.
struct NodeRobot {
  std::optional<Ros2Profile> profile{};  ///< set if the robot has its own ROS 2 nodes
  std::vector<MountedCamera> cameras{};
  bool own_images = true;  ///< whether the camera "cam" is the one on the profile's topics
};

/// The frame names of a robot, taken from its odometry and camera messages; the defaults are odom, base_link
/// and camera_optical. Subscribes to the topics of the profile until a message with the names has arrived.
/// Not thread-safe.
class RobotFrames {
 public:
  explicit RobotFrames(NodeRobot robot);

  Status join(Bus& bus);
  /// Handles a message for one of its own subscriptions. Returns false for other messages.
  bool take(Bus& bus, const BusMessage& message);
  /// Call when the robot's first sample arrives. Names that have not arrived three seconds later are set to
  /// their defaults.
  void robot_started(Duration now);
  /// Whether all names are final.
  [[nodiscard]] bool settled(Duration now) const;

  [[nodiscard]] std::string odom() const;
  [[nodiscard]] std::string base() const;
  [[nodiscard]] std::string camera(std::string_view name) const;
  /// Call for each camera that provides images or tags. Returns all camera mountings that this program must
  /// publish, because no transform on the network connects their frames to the base; `nullopt` if nothing has
  /// changed.
  [[nodiscard]] std::optional<ros2::TFMessage> mount(Bus& bus, const std::string& camera, Duration now);

 private:
  Status listen(Bus& bus, const std::string& topic, std::string_view type, const TopicQos& qos,
                std::optional<std::size_t>& number);
  void receive_odometry(const BusMessage& message);
  void receive_camera(const BusMessage& message);
  void receive_transforms(const BusMessage& message);
  static void end(Bus& bus, std::optional<std::size_t>& number);

  NodeRobot robot_;
  std::string odom_{};
  std::string base_{};
  std::string camera_{};
  std::optional<std::size_t> odometry_{};  ///< subscriptions, which are reset once their names have arrived
  std::optional<std::size_t> images_{};
  std::optional<std::size_t> fixed_{};
  std::optional<std::size_t> moving_{};
  FrameTree tree_{};
  std::optional<Duration> since_{};
  std::set<std::string> checked_cameras_{};
  ros2::TFMessage mountings_{};
};

/// Publishes a drive on ROS 2 (docs/howto/ros2.md): /tf from map to odom (REP 105), /waymark/pose,
/// /waymark/tags, /waymark/path, /waymark/markers, /waymark/image/compressed (if subscribed) and
/// /diagnostics. Also publishes /tf_static if frames of cameras are not connected to the base. The services
/// /waymark/start_teach, map, replay, pause and stop (std_srvs/Trigger) act as the buttons for the drive. A
/// pose on /initialpose sets the robot's pose. Runs on its own thread, which receives the updates from the
/// feed.
class Ros2Node {
 public:
  /// The feed must outlive the node.
  static Result<std::unique_ptr<Ros2Node>> start(std::unique_ptr<Bus> bus, LiveFeed& feed,
                                                 NodeRobot robot = {});
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

 private:
  Ros2Node(std::unique_ptr<Bus> bus, LiveFeed& feed, NodeRobot robot)
      : bus_(std::move(bus)), services_(*bus_), feed_(feed), frames_(std::move(robot)) {}
  Status offer_services();
  Status subscribe_initial_pose();
  void receive(const BusMessage& message);
  void run();
  void publish_updates();
  void publish_item(const Sample& sample);
  void publish_item(const TagFrame& tags);
  void mount(const std::string& camera);
  void keep_clock(const LiveSample& sample);
  void show(const TagFrame& tags);
  void take_back(LiveSample& sample);
  void publish_item(const ros2::PoseWithCovarianceStamped& estimate);
  void publish_item(const ros2::DiagnosticArray& compared);
  void publish_status(const LiveStatus& status);
  /// The index of the publisher for a topic. `nullopt` if it cannot be created; the drive then continues
  /// without it.
  std::optional<std::size_t> publisher_of(const std::string& topic, std::string_view type,
                                          const TopicQos& qos);
  template <class Message>
  void publish(const std::string& topic, const Message& message, bool kept = false);

  std::unique_ptr<Bus> bus_;
  TriggerServices services_;
  LiveFeed& feed_;
  RobotFrames frames_;
  LiveStatus status_{};
  std::deque<double> behind_s_{};       ///< this computer's clock minus odometry timestamps
  std::optional<CameraFrame> image_{};  ///< newest image
  Duration shown_{};                    ///< when the last image was published
  std::shared_ptr<const ros2::MarkerArray> shapes_{};
  std::deque<Odometry> odometry_{};
  ros2::Path path_{};
  Duration status_published_{};
  std::map<std::string, std::size_t> publishers_{};
  std::size_t initial_pose_ = 0;  ///< index of the subscription
  int refused_poses_ = 0;
  std::size_t unreliable_tags_ = 0;  ///< number of detections left out of /waymark/tags
  std::atomic<bool> over_ = false;
  std::thread thread_{};
};

/// The button that a service presses in the current phase of the drive (OperatorState), or why it has no
/// effect.
struct ServiceButton {
  std::optional<ViewerOrder::Kind> press{};
  std::string words{};
};
[[nodiscard]] ServiceButton button_of_service(const std::string& service, const std::string& phase);
/// Names of the services in messages to the operator.
[[nodiscard]] ViewerLabels service_labels();

}  // namespace waymark
