#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/live/ros2_node.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/runtime/viewer_input.hpp"
#include "waymark/server/http_server.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {

/// How the page is served.
struct PageOptions {
  int port = 8642;  ///< where it is taken, any other; 0: any
  std::string listen = "127.0.0.1";
  std::string token = {};  ///< empty: a random one, where one is needed
  bool open = false;       ///< in the browser

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.port,
          JobField("port INT", "Port of the page; where it is taken, any other. 0: any", 0, 65535));
    visit(
        self.listen,
        JobField(
            "listen ADDRESS",
            "Address of this machine at which others reach the page, 0.0.0.0 for all; they need the token"));
    visit(self.token, JobField("token WORD",
                               "Token that grants control and remote viewing: 16 characters or more. Unless "
                               "given: a random one"));
    visit(self.open, JobField("open", "Open the page in the browser"));
  }

  /// The same of a page that is served only with a field `view`.
  template <class Self, class Visitor>
  static void fields_of_view(Self& self, Visitor&& visit) {
    fields(self, [&](auto& value, const JobField& field) {
      visit(value, field.name == "open" ? field.needs("view") : field.needs("view").less());
    });
  }
};

/// Who may watch a session while it runs, if anybody.
struct ViewerOptions {
  bool view = false;         ///< in the browser ...
  bool ros2 = false;         ///< ... or on the network of ROS 2,
  std::string ros_distro{};  ///< in the node list of this release; empty: in none
  PageOptions page{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.view, JobField("view", "Show the robot in the browser while it runs, with buttons"));
    PageOptions::fields_of_view(self.page, visit);
    visit(self.ros2, JobField("publish_ros2",
                              "Publish pose, /tf, tags and path on the network of ROS 2, with services as "
                              "buttons: docs/howto/ros2.md")
                         .excludes("view")
                         .less());
    visit(self.ros_distro, JobField("ros_distro NAME", kRosDistroHelp).needs("publish_ros2").less());
  }
};

/// Options of the server; a server that others reach, or that shows a robot (`live`), gets a token where none
/// is given. Fails on a token that is too weak.
[[nodiscard]] Result<ServerOptions> server_options(const PageOptions& page, bool live);

/// Reports what is worth reporting of a page that is served, such as its other addresses, and opens it if
/// asked to. `address` gets the first one.
void announce(const HttpServer& server, const PageOptions& page, const JobControl& control,
              const std::function<void(const std::string&)>& address);

/// Asks the desktop to show the page; false: it could not.
[[nodiscard]] bool open_browser(const std::string& url);

/// The page of a robot that runs, served by a thread of its own until this is destroyed. The robot's loop
/// must have ended by then.
class LivePage {
 public:
  /// Fails when the robot of the setup is no process: a simulated one in this process goes as fast as it can,
  /// which nobody could watch.
  static Result<std::unique_ptr<LivePage>> start(const PageOptions& page, const RobotSetup& setup,
                                                 const JobControl& control);
  /// The same as a node of ROS 2 instead of a page, where the environment variables of ROS say; in the node
  /// list of the release that `distro` names.
  static Result<std::unique_ptr<LivePage>> start_ros2(const RobotSetup& setup, const std::string& distro);
  static Result<std::unique_ptr<LivePage>> start_ros2(const std::string& distro);
  /// The page of whatever fills the feed, by name.
  static Result<std::unique_ptr<LivePage>> start(const PageOptions& page, const std::string& name,
                                                 const JobControl& control);
  /// Whichever the options ask for; nullptr where nobody is to watch.
  static Result<std::unique_ptr<LivePage>> open(const ViewerOptions& viewers, const RobotSetup& setup,
                                                const JobControl& control);
  /// The same of whatever fills the feed, by name, such as a live camera.
  static Result<std::unique_ptr<LivePage>> open(const ViewerOptions& viewers, const std::string& name,
                                                const JobControl& control);
  ~LivePage();
  LivePage(const LivePage&) = delete;
  LivePage& operator=(const LivePage&) = delete;

  [[nodiscard]] LiveFeed& feed() { return feed_; }

 private:
  static Result<std::unique_ptr<LivePage>> start_ros2(NodeRobot robot, const std::string& distro);
  LivePage() = default;
  LiveFeed feed_{};
  std::unique_ptr<HttpServer> server_{};
  std::unique_ptr<Ros2Node> node_{};
  std::atomic<bool> over_{false};
  std::thread thread_{};
};

/// The system's clock, as the feed wants it.
[[nodiscard]] std::int64_t host_now_ns();

/// A listener whose samples viewers see as well, if there is a feed, and that the control ends.
[[nodiscard]] RobotListener watched(RobotListener listener, LiveFeed* feed, const JobControl& control);

/// What viewers are shown of a session, of a lap that is taught, or of a replay. Without a feed nothing
/// happens.
class SessionViewers {
 public:
  explicit SessionViewers(LiveFeed* feed) : feed_(feed) {}

  void show_camera(const SimulatedSetup& setup);
  /// map.yaml, route.yaml and robot.yaml of the folder, those that are there; the map as shapes, too.
  void show_map(const std::filesystem::path& folder);
  void tell(const Operator& session, const OperatorInput& input);
  void tell(LiveStatus status);
  /// Hears each decision of a replay and shows estimates, what was compared with them, and progress. Only the
  /// newest is received.
  [[nodiscard]] std::function<void(const ReplayStep&)> watch(double goal_m);

 private:
  LiveFeed* feed_;
  double goal_m_ = 0;
  double driven_m_ = 0;
  std::optional<bool> certain_{};
  std::string halted_{};
};

/// One phase of the session by itself, as `waymark teach` and `waymark replay` run it, with its viewers.
class PhaseViewers {
 public:
  /// `keys_taken`: a driver reads the keys of the terminal itself.
  PhaseViewers(LiveFeed* feed, const SimulatedSetup& setup, OperatorState phase, bool keys_taken = false);
  /// What viewers and the space bar of the terminal want; this must live for as long as they are asked.
  [[nodiscard]] SessionRequests requests();
  [[nodiscard]] SessionViewers& viewers() { return viewers_; }

 private:
  void tell();
  SessionViewers viewers_;
  StopKey stop_key_;
  PhaseRequests requests_;
  bool shown_;
};

}  // namespace waymark
