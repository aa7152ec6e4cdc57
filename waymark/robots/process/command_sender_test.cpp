// Tests that the input of a robot process decides whether anything is sent to the robot.
#include "waymark/robots/process/command_sender.hpp"

#include <array>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

TEST(CommandRepeat, RepeatsTwentyTimesASecondAndStopsAfterTheTimeout) {
  Random random(1);
  CommandRepeat repeat;
  Duration last_published{};
  Duration last_given = Duration(-1);
  for (Duration now{}; now < std::chrono::seconds(60); now += milliseconds(1)) {
    const bool there = (now / std::chrono::seconds(5)) % 2 == 0;  // the driver comes and goes repeatedly
    if (there && random.uniform() < 0.03) {
      repeat.offer({0.3, 0.1}, now);
      last_given = now;
    }
    const auto command = repeat.due(now);
    if (!command) {
      ASSERT_LE(now - last_published, milliseconds(50));
      continue;
    }
    last_published = now;
    const bool fresh = last_given >= Duration(0) && now - last_given <= milliseconds(250);
    ASSERT_EQ(command->speed_m_s != 0, fresh) << now.count();
  }
}

TEST(CommandRepeat, ReplacesNonFiniteCommandsByZero) {
  CommandRepeat repeat;
  repeat.offer({std::numeric_limits<double>::quiet_NaN(), 1}, milliseconds(1));
  const auto command = repeat.due(milliseconds(1));
  ASSERT_TRUE(command);
  EXPECT_EQ(*command, VelocityCommand{});
}

using std::chrono::milliseconds;

constexpr const char* kListens = "{\"type\":\"hello\",\"protocol_version\":1,\"listen_only\":true}\n";
constexpr const char* kDrives = "{\"type\":\"hello\",\"protocol_version\":1,\"command_timeout_s\":0.25}\n";
constexpr const char* kForward = "{\"type\":\"velocity\",\"speed_m_s\":0.3,\"yaw_rate_rad_s\":0}\n";

class Input {
 public:
  Input() { EXPECT_EQ(pipe(ends_.data()), 0); }
  ~Input() {
    close_writer();
    close(ends_[0]);
  }
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;

  void write_line(const std::string& line) const {
    EXPECT_EQ(write(ends_[1], line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }
  void close_writer() {
    if (ends_[1] >= 0) close(std::exchange(ends_[1], -1));
  }
  [[nodiscard]] RobotWire wire(bool listen_only = false) const {
    return {.input = ends_[0], .listen_only = listen_only};
  }

 private:
  std::array<int, 2> ends_{};
};

/// The commands that have reached the robot.
class Sent {
 public:
  void add(const VelocityCommand& command) {
    const std::scoped_lock lock(mutex_);
    all_.push_back(command);
  }
  [[nodiscard]] std::vector<VelocityCommand> all() const {
    const std::scoped_lock lock(mutex_);
    return all_;
  }
  [[nodiscard]] bool moved() const {
    for (const VelocityCommand& command : all())
      if (command.speed_m_s != 0) return true;
    return false;
  }

 private:
  mutable std::mutex mutex_{};
  std::vector<VelocityCommand> all_{};
};

template <class Condition>
bool wait_for(const Condition& condition) {
  for (int i = 0; i < 500 && !condition(); ++i) usleep(10'000);
  return condition();
}

TEST(CommandSender, SendsNothingBeforeTheInputDrives) {
  Input input;
  Sent sent;
  CommandSender sender([&](const VelocityCommand& command) { sent.add(command); }, input.wire());
  usleep(200'000);
  EXPECT_TRUE(sent.all().empty());
  EXPECT_EQ(sender.role(), InputRole::Unknown);
  input.write_line(kDrives);
  EXPECT_TRUE(wait_for([&] { return sent.all().size() > 3; })) << "zero, repeatedly";
  EXPECT_FALSE(sent.moved());
  input.write_line(kForward);
  EXPECT_TRUE(wait_for([&] { return sent.moved(); }));
  input.close_writer();
  EXPECT_TRUE(wait_for([&] { return sender.ended(); }));
  EXPECT_EQ(sent.all().back(), VelocityCommand{});
}

TEST(CommandSender, AVelocityWithoutAHelloDrivesToo) {
  Input input;
  Sent sent;
  const CommandSender sender([&](const VelocityCommand& command) { sent.add(command); }, input.wire());
  input.write_line(kForward);
  EXPECT_TRUE(wait_for([&] { return sent.moved(); }));
}

TEST(CommandSender, SendsNothingForAnInputThatListens) {
  for (const bool by_flag : {false, true}) {
    Input input;
    Sent sent;
    EarlyInput early(input.wire(by_flag));
    if (!by_flag) input.write_line(kListens);
    EXPECT_FALSE(early.received_bye());
    ASSERT_EQ(early.role(), InputRole::Listens);
    {
      CommandSender sender([&](const VelocityCommand& command) { sent.add(command); }, input.wire(by_flag),
                           early.role());
      input.write_line(kForward);
      input.close_writer();
      EXPECT_TRUE(wait_for([&] { return sender.ended(); }));
    }
    EXPECT_TRUE(sent.all().empty()) << "not even zero at the end";
  }
}

}  // namespace
}  // namespace waymark
