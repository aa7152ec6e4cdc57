// Tests the files of an operator's session. Then tests a session with a simulated gamepad and a robot
// process: teach with the sticks, map, replay, pause, resume, stop with a stick, and replay again.
#include "waymark/app/session/run_session.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/explore_world.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/inputs/gamepad/pad_input.hpp"
#include "waymark/simulation/robot/scripted_driver.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

void write_words(const fs::path& path, const std::string& words) { std::ofstream(path) << words; }

std::string words_in(const fs::path& path) { return read_text_file(path, 1 << 20).value_or("no file"); }

/// A map maker that writes this text to map.yaml in its folder.
MapMaker maker_of(const std::string& words) {
  return [words](const std::string& lap, const fs::path& folder) -> Status {
    fs::create_directories(folder);
    return write_text_file(folder / "map.yaml", words + " of " + fs::path(lap).filename().string());
  };
}

Status broken_maker(const std::string& /*lap*/, const fs::path& folder) {
  fs::create_directories(folder);
  write_words(folder / "map.yaml", "half of it");
  return fail(ErrorCode::NotFound, "the anchor was never seen");
}

class SessionFiles : public ::testing::Test {
 protected:
  fs::path folder_ = testing::fresh_folder("live_session");
  fs::path map_ = folder_ / "map";
  MapInTheMaking making_{};
};

TEST_F(SessionFiles, NamesAreUnique) {
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.mcap").string());
  write_words(folder_ / "lap.mcap", "first");
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.2.mcap").string());
  write_words(folder_ / "lap.2.mcap", "second");
  EXPECT_EQ(free_name(folder_, "lap"), (folder_ / "lap.3.mcap").string());
  EXPECT_EQ(free_name(folder_, "replay"), (folder_ / "replay.mcap").string());
}

TEST_F(SessionFiles, TheNewMapReplacesTheOldOneWhichIsRenamed) {
  EXPECT_FALSE(making_.under_way());
  EXPECT_FALSE(making_.ready());
  std::vector<std::string> kept;
  for (const char* words : {"first", "second", "third"}) {
    making_.begin(maker_of(words), "lap.mcap", map_);
    EXPECT_TRUE(making_.under_way());
    const auto older = making_.take();
    ASSERT_TRUE(older) << to_string(older.error());
    kept.push_back(*older);
    EXPECT_FALSE(making_.under_way());
    EXPECT_EQ(words_in(map_ / "map.yaml"), std::string(words) + " of lap.mcap");
    EXPECT_GE(making_.seconds(), 0);
  }
  EXPECT_EQ(kept, (std::vector<std::string>{"", map_.string() + ".1", map_.string() + ".2"}));
  EXPECT_EQ(words_in(map_.string() + ".1/map.yaml"), "first of lap.mcap");
  EXPECT_EQ(words_in(map_.string() + ".2/map.yaml"), "second of lap.mcap");
  EXPECT_FALSE(fs::exists(map_.string() + ".new"));
}

TEST_F(SessionFiles, AFailedMapLeavesTheOlderOneUnchanged) {
  making_.begin(maker_of("good"), "lap.mcap", map_);
  ASSERT_TRUE(making_.take());
  making_.begin(broken_maker, "lap.2.mcap", map_);
  const auto failed = making_.take();
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "the anchor was never seen");
  EXPECT_EQ(words_in(map_ / "map.yaml"), "good of lap.mcap");
  EXPECT_FALSE(fs::exists(map_.string() + ".new")) << "the incomplete map is removed";
  EXPECT_FALSE(fs::exists(map_.string() + ".1"));
}

TEST_F(SessionFiles, RemovesWhatAnInterruptedSessionLeft) {
  fs::create_directories(map_.string() + ".new");
  write_words(map_.string() + ".new/stray.yaml", "of another session");
  making_.begin(maker_of("new"), "lap.mcap", map_);
  ASSERT_TRUE(making_.take());
  EXPECT_TRUE(fs::exists(map_ / "map.yaml"));
  EXPECT_FALSE(fs::exists(map_ / "stray.yaml"));
}

TEST_F(SessionFiles, AMissingMapIsAnErrorWithItsPlace) {
  fs::create_directories(map_);
  write_words(map_ / "map.yaml", "older");
  making_.begin([](const std::string&, const fs::path&) { return Status(); }, "lap.mcap", map_);
  const auto taken = making_.take();
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(taken.error().place.source, map_.string());
  EXPECT_EQ(words_in(map_ / "map.yaml"), "older") << "the previous map is unchanged";
}

namespace fs = std::filesystem;

using S = OperatorState;

constexpr int kY = 3;

constexpr int kBack = 4;

constexpr int kLeftShoulder = 9;

constexpr double kSpeed_m_s = 0.3;

GamepadState at_rest() {
  return {.axes = std::vector<float>(6, 0.0F), .buttons = std::vector<std::int32_t>(15, 0)};
}

/// A simulated gamepad, operated by the class below.
class FakePad final : public Gamepad {
 public:
  explicit FakePad(std::shared_ptr<GamepadState> state) : state_(std::move(state)) {}
  Result<GamepadState> poll(SensorTime now) override {
    GamepadState state = *state_;
    state.stamp = now;
    return state;
  }

 private:
  std::shared_ptr<GamepadState> state_;
};

/// The stick position that the driver converts to this fraction of the maximum.
float stick(double share) {
  constexpr double kDeadZone = 0.1;
  const double beyond = std::min(1.0, std::abs(share));
  return share == 0 ? 0.0F : static_cast<float>(std::copysign(kDeadZone + (1 - kDeadZone) * beyond, share));
}

/// Follows the path in the world and tests the buttons in order.
class Hand final : public OperatorInput {
 public:
  Hand(const SimulatedSetup& setup, double& moved_while_paused_m, int& pauses)
      : moved_while_paused_m_(moved_while_paused_m),
        pauses_(pauses),
        state_(std::make_shared<GamepadState>(at_rest())),
        pad_(std::make_unique<PadInput>(std::make_unique<FakePad>(state_), kSpeed_m_s)),
        driver_(sample_path(setup.world.path_m, true, 0.02), true, {.speed_m_s = kSpeed_m_s}, Random(3)) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, S state) override {
    if (state != last_) since_ = uptime;
    last_ = state;
    in_state_s_ = to_seconds(uptime - since_);
    *state_ = at_rest();
    if (state == S::Teaching)
      teach(now);
    else
      go_on(state);
    return pad_->read(uptime, now, state);
  }
  void receive(const Sample& sample) override {
    const auto* truth = std::get_if<TruthPose>(&sample);
    if (truth == nullptr) return;
    const SE2 here = project_to_plane(truth->map_T_base);
    if (here_ && last_ == S::Replaying) replayed_m_ += (here.translation() - here_->translation()).norm();
    if (here_ && last_ == S::Paused && in_state_s_ > 0.8)
      moved_while_paused_m_ += (here.translation() - here_->translation()).norm();
    here_ = here;
  }
  std::string usage() const override { return pad_->usage(); }

 private:
  /// Presses a button once, half a second after entering the state, because buttons are debounced.
  void press(int button) {
    if (in_state_s_ > 0.5 && in_state_s_ < 0.56) state_->buttons[static_cast<std::size_t>(button)] = 1;
  }
  void teach(SensorTime now) {
    if (!here_) return;
    const VelocityCommand command = driver_.drive(*here_, now);
    if (driver_.done()) {
      state_->buttons[kY] = tick_++ % 2;
      return;
    }
    state_->buttons[kLeftShoulder] = 1;
    state_->axes[1] = stick(command.speed_m_s / kSpeed_m_s);
    state_->axes[2] = stick(command.yaw_rate_rad_s);
  }
  void go_on(S state) {
    if (state == S::Idle || state == S::Ready || state == S::Stopped) press(kY);
    if (state == S::Done) press(kBack);
    if (state == S::Replaying && replayed_m_ > 0.6 && pauses_ == 0) {
      state_->buttons[kY] = 1;
      ++pauses_;
    }
    if (state == S::Paused && in_state_s_ > 2) state_->buttons[kY] = 1;
    if (state == S::Replaying && replayed_m_ > 1.2 && !reached_for_it_) {
      state_->axes[0] = 0.5F;
      reached_for_it_ = true;
    }
  }

  double& moved_while_paused_m_;
  int& pauses_;
  std::shared_ptr<GamepadState> state_;
  std::unique_ptr<OperatorInput> pad_;
  ScriptedDriver driver_;
  S last_ = S::Over;
  Duration since_{};
  double in_state_s_ = 0;
  double replayed_m_ = 0;
  bool reached_for_it_ = false;
  int tick_ = 0;
  std::optional<SE2> here_{};
};

TEST(SessionRun, AGamepadTeachesReplaysPausesAndStops) {
  const fs::path folder = fs::temp_directory_path() / ("waymark-session-" + std::to_string(getpid()));
  fs::create_directories(folder);
  RobotSetup setup = load_setup("circuit24", "limo", 4).value();
  setup.process = "exec '" WAYMARK_PROGRAM "' robot-sim --world circuit24 --seed 4 --lockstep";
  double moved_while_paused_m = 0;
  int pauses = 0;
  std::string notes;
  JobControl control;
  control.note = [&notes](const std::string& note) { notes += note + "\n"; };
  const auto report =
      run_session(setup, {.folder = folder / "session", .driver = "gamepad", .speed_m_s = kSpeed_m_s},
                  std::make_unique<Hand>(setup.simulated, moved_while_paused_m, pauses), control);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_EQ(report->laps_taught, 1);
  EXPECT_FALSE(report->map_failed);
  EXPECT_EQ(report->state, "over");
  EXPECT_EQ(pauses, 1);
  EXPECT_LT(moved_while_paused_m, 0.01) << "stationary while paused";
  ASSERT_EQ(report->replays.size(), 2U) << notes;
  EXPECT_FALSE(report->replays[0].end.finished) << "a stick stopped it";
  EXPECT_TRUE(report->replays[1].end.finished) << ending(report->replays[1]);
  ASSERT_TRUE(report->replays[1].judgement);
  EXPECT_LT(report->replays[1].judgement->cross_track_max_m, 0.04);
  std::size_t from = 0;
  for (const char* part : {"idle. ", "teaching. ", "mapping. ", "ready. ", "replaying. ", "paused. ",
                           "replaying. ", "stopped: ", "replaying. ", "done. "}) {
    from = notes.find(part, from);
    ASSERT_NE(from, std::string::npos) << part << " in\n" << notes;
  }
  EXPECT_EQ(notes.find("stopped: stopped"), std::string::npos) << notes;
  fs::remove_all(folder);
}

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(SessionChecks, ARouteNeedsAMapAndSuccessMeansAllReplays) {
  SessionJob job;
  EXPECT_EQ(words(check_session(job)), "");
  job.replay.route = "kitchen";
  EXPECT_THAT(words(check_session(job)), StartsWith("(route): "));
  testing::expect_on_page("session", words(check_session(job)));
  job.map = "map";
  EXPECT_EQ(words(check_session(job)), "");
  SessionReport report;
  EXPECT_TRUE(succeeded(report));
  report.map_failed = true;
  EXPECT_FALSE(succeeded(report));
  report = {.replays = {ReplayReport{}}};
  EXPECT_FALSE(succeeded(report));
}

TEST(SessionReportText, ContainsTheEndOfEachReplayAndWhoStoppedIt) {
  SessionReport report{.laps_taught = 1};
  report.replays.resize(2);
  report.replays[0].end.interrupted = true;
  report.replays[0].end.driven_m = 1.5;
  report.replays[0].route_length_m = 10;
  report.replays[1].end.finished = true;
  report.replays[1].judgement = ReplayJudgement{};
  report.replays[1].judgement->cross_track_max_m = 0.02;
  const std::string text = to_text(report, "Ctrl-C");
  EXPECT_THAT(text, HasSubstr("1 lap taught, 2 replays"));
  for (const char* part : {"Ctrl-C 1.50 m", "10.00 m", "0.000 m rmse", "0.020 m max"})
    EXPECT_THAT(text, HasSubstr(part));
  testing::expect_on_page("session", text);
  const auto json = to_json(fields(report));
  ASSERT_EQ(json["replays"].size(), 2U);
  EXPECT_TRUE(json["replays"][0]["cross_track_rmse_m"].is_null()) << "not evaluated";
  EXPECT_FALSE(json["replays"][1]["cross_track_rmse_m"].is_null());
}

}  // namespace
}  // namespace waymark
