#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "waymark/cli/live_driver.hpp"
#include "waymark/cli/pilot.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark::cli {

/// What viewers ask for, turned into what a pilot does; and what happens when the one in control goes away:
/// while teaching the robot stands until somebody takes over, a replay pauses.
class PageOrders {
 public:
  explicit PageOrders(LiveFeed& feed) : feed_(feed) {}

  struct Act {
    std::vector<OperatorEvent> events{};
    std::optional<VelocityCommand> drive{};  ///< somebody drives with the page's keys
    bool script = false;                     ///< somebody asked the script to drive
    bool stand = false;                      ///< whatever the others want
  };
  Act act(Duration uptime, OperatorState state);
  /// Somebody at the robot did something: they see it.
  void somebody_is_here() { stand_ = false; }

 private:
  LiveFeed& feed_;
  LiveFeed::Control before_ = LiveFeed::Control::Nobody;
  VelocityCommand command_{};
  std::optional<Duration> told_{};
  bool stand_ = false;
  bool pause_ = false;
  Duration pause_asked_{};
};

/// Another pilot, and the page beside it. Without another the page alone decides; `script` is who drives a
/// taught lap on request, where one knows the way.
class PagePilot final : public Pilot {
 public:
  /// Makes a driver that stands at the begin of the lap; nullptr where nobody knows the way.
  using MakeScript = std::function<std::unique_ptr<LiveDriver>()>;
  PagePilot(LiveFeed& feed, std::unique_ptr<Pilot> other, MakeScript make_script)
      : orders_(feed),
        other_(std::move(other)),
        make_script_(std::move(make_script)),
        script_(make_script_()) {}

  Result<PilotAct> act(Duration uptime, SensorTime now, OperatorState state) override;
  void hear(const Sample& sample) override;
  [[nodiscard]] std::string usage() const override;
  [[nodiscard]] OperatorButtons buttons() const override {
    return other_ ? other_->buttons() : OperatorButtons{"'go'", "'stop'", "take control and drive"};
  }
  [[nodiscard]] bool page_drives() const override { return other_ == nullptr; }
  [[nodiscard]] bool has_script() const override { return script_ != nullptr && truth_heard_ && !scripting_; }

 private:
  PageOrders orders_;
  std::unique_ptr<Pilot> other_;
  MakeScript make_script_;
  std::unique_ptr<LiveDriver> script_;
  bool scripting_ = false;
  bool script_used_ = false;
  bool truth_heard_ = false;  ///< a script is told where the robot truly is
};

/// The state of the story, for viewers.
[[nodiscard]] LiveStatus status_of(const Operator& story, const Pilot& pilot);

}  // namespace waymark::cli
