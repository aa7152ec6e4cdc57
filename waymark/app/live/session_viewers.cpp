#include "waymark/app/live/session_viewers.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/recording/ros2/map_markers.hpp"

namespace waymark {

void SessionViewers::show_camera(const SimulatedSetup& setup) {
  if (feed_ == nullptr) return;
  feed_->show_camera(setup.camera, setup.model.base_T_cam);
  const MappedTag* anchor = setup.world.tags.find(setup.world.anchor);
  if (anchor != nullptr) feed_->show_text("tags.yaml", fmt::format("tag_size_m: {}\n", anchor->size_m));
}

void SessionViewers::show_map(const std::filesystem::path& folder) {
  constexpr std::size_t kMostShownBytes = std::size_t{2} << 20U;  // a page has to hold it
  if (feed_ == nullptr) return;
  for (const char* name : {"map.yaml", "route.yaml", "robot.yaml"}) {
    auto text = read_text_file(folder / name, kMostShownBytes);
    if (text) feed_->show_text(name, std::move(*text));
  }
  const Result<MapFile> map = read_map(folder / "map.yaml");
  const Result<Route> route = read_route(folder / "route.yaml");
  if (map) feed_->show_shapes(map_markers(map->tags, route ? *route : Route{}));
}

void SessionViewers::tell(const Operator& session, const OperatorInput& input) {
  if (feed_ == nullptr) return;
  tell({.phase = std::string(to_string(session.state())),
        .reason = session.reason(),
        .commands = viewer_commands(session.state(), input.has_script()),
        .page_drives = input.page_drives()});
}

void SessionViewers::tell(LiveStatus status) {
  if (feed_ == nullptr) return;
  const bool replays = status.phase == "replaying" || status.phase == "paused";
  status.goal_m = goal_m_;
  status.driven_m = driven_m_;
  if (replays) {
    status.certain = certain_;
    status.halted = halted_;
  }
  feed_->tell(status);
}

std::function<void(const ReplayStep&)> SessionViewers::watch(double goal_m) {
  goal_m_ = goal_m;
  driven_m_ = 0;
  return [this](const ReplayStep& step) {
    if (feed_ == nullptr) return;
    driven_m_ = step.driven_m;
    certain_ = step.estimate && step.estimate->certain;
    halted_ = step.reason.value_or("");
    if (step.estimate) feed_->publish(estimate_message(*step.estimate), host_now_ns());
    for (const NisRecord& record : step.compared) feed_->publish(nis_message(record), host_now_ns());
  };
}

PhaseViewers::PhaseViewers(LiveFeed* feed, const SimulatedSetup& setup, OperatorState phase, bool keys_taken)
    : viewers_(feed),
      stop_key_(keys_taken),
      requests_(viewer_link(feed), phase, [this] { return stop_key_.pressed(); }),
      shown_(feed != nullptr) {
  viewers_.show_camera(setup);
}

void PhaseViewers::tell() {
  LiveStatus status{.phase = std::string(to_string(requests_.phase())), .commands = {"go", "stop"}};
  if (requests_.phase() == OperatorState::Teaching) status.commands = {"go"};
  viewers_.tell(std::move(status));
}

SessionRequests PhaseViewers::requests() {
  return [this](Duration uptime) {
    SessionRequest request = requests_.read(uptime);
    if (shown_) tell();
    return request;
  };
}

}  // namespace waymark
