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

/// A robot as a node for others needs to know it.
struct NodeRobot {
  std::optional<Ros2Profile> profile{};  ///< of a robot that speaks ROS 2 itself
  std::vector<MountedCamera> cameras{};
  bool own_pictures = true;  ///< the camera "cam" is the one of the profile's topics
};

/// The names of a robot's frames, as it has them itself: those of its odometry, and of its camera's messages.
/// Of what is not said there the names are odom, base_link and camera_optical. Listens to the topics of the
/// profile until they said it; one thread.
class RobotFrames {
 public:
  explicit RobotFrames(NodeRobot robot);

  Status join(Bus& bus);
  /// Whether the message was for it, and is dealt with.
  bool take(Bus& bus, const BusMessage& message);
  /// The robot is there: from now on what it does not say within three seconds counts as not said.
  void robot_speaks(Duration now);
  /// Nothing is waited for any more.
  [[nodiscard]] bool settled(Duration now) const;

  [[nodiscard]] std::string odom() const;
  [[nodiscard]] std::string base() const;
  [[nodiscard]] std::string camera(std::string_view name) const;
  /// All mountings that this program has to publish, since this camera is seen, too, and no transform on the
  /// network joins its frame to the base; nothing where they are those of the call before.
  [[nodiscard]] std::optional<ros2::TFMessage> mount(Bus& bus, const std::string& camera, Duration now);

 private:
  Status listen(Bus& bus, const std::string& topic, std::string_view type, const TopicQos& qos,
                std::optional<std::size_t>& number);
  void hear_odometry(const BusMessage& message);
  void hear_camera(const BusMessage& message);
  void hear_transforms(const BusMessage& message);
  static void end(Bus& bus, std::optional<std::size_t>& number);

  NodeRobot robot_;
  std::string odom_{};
  std::string base_{};
  std::string camera_{};
  std::optional<std::size_t> odometry_{};  ///< subscriptions, while something is to be learned there
  std::optional<std::size_t> pictures_{};
  std::optional<std::size_t> fixed_{};
  std::optional<std::size_t> moving_{};
  FrameTree tree_{};
  std::optional<Duration> since_{};
  std::set<std::string> looked_at_{};  ///< cameras
  ros2::TFMessage mountings_{};
};

/// What a drive says, to any ROS 2 program (docs/howto/ros2.md): /tf from map to odom (REP 105),
/// /waymark/pose, /waymark/tags, /waymark/path, /waymark/markers, /waymark/image/compressed where somebody
/// wants it, /diagnostics; /tf_static of cameras whose frames nobody joins to the base; and the services
/// /waymark/start_teach, map, replay, pause and stop (std_srvs/Trigger), which are the buttons of the drive.
/// Who publishes /initialpose says where the robot is.
/// On a thread of its own, which takes the feed.
class Ros2Node {
 public:
  /// The feed outlives the node.
  static Result<std::unique_ptr<Ros2Node>> start(std::unique_ptr<Bus> bus, LiveFeed& feed,
                                                 NodeRobot robot = {});
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

 private:
  Ros2Node(std::unique_ptr<Bus> bus, LiveFeed& feed, NodeRobot robot)
      : bus_(std::move(bus)), services_(*bus_), feed_(feed), frames_(std::move(robot)) {}
  Status offer_services();
  Status hear_initial_pose();
  void receive(const BusMessage& message);
  void run();
  void publish_updates();
  void say(const Sample& sample);
  void say(const TagFrame& tags);
  void mount(const std::string& camera);
  void keep_clock(const LiveSample& sample);
  void show(const TagFrame& tags);
  void take_back(LiveSample& sample);
  void say(const ros2::PoseWithCovarianceStamped& estimate);
  void say(const ros2::DiagnosticArray& compared);
  void say_status(const LiveStatus& status);
  /// The number of the publisher of a topic; nothing where the network makes none, and the drive goes on.
  std::optional<std::size_t> publisher_of(const std::string& topic, std::string_view type,
                                          const TopicQos& qos);
  template <class Message>
  void publish(const std::string& topic, const Message& message, bool kept = false);

  std::unique_ptr<Bus> bus_;
  TriggerServices services_;
  LiveFeed& feed_;
  RobotFrames frames_;
  LiveStatus status_{};
  std::deque<double> behind_s_{};         ///< this computer's clock less the stamps of odometry
  std::optional<CameraFrame> picture_{};  ///< the newest
  Duration shown_{};                      ///< when a picture was published
  std::shared_ptr<const ros2::MarkerArray> shapes_{};
  std::deque<Odometry> odometry_{};
  ros2::Path path_{};
  Duration status_said_{};
  std::map<std::string, std::size_t> publishers_{};
  std::size_t initial_pose_ = 0;  ///< subscription
  int refused_poses_ = 0;
  std::atomic<bool> over_ = false;
  std::thread thread_{};
};

/// Which button a service presses in a phase of the drive, or why none; the phases are those of
/// OperatorState.
struct ServiceButton {
  std::optional<ViewerOrder::Kind> press{};
  std::string words{};
};
[[nodiscard]] ServiceButton button_of_service(const std::string& service, const std::string& phase);
/// What an operator is told of them.
[[nodiscard]] ViewerWords service_words();

}  // namespace waymark
