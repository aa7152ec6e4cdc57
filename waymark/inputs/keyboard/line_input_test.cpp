#include "waymark/inputs/keyboard/line_input.hpp"

#include <array>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using std::chrono::milliseconds;
using std::chrono::seconds;

class Lines : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(pipe(ends_.data()), 0); }
  void TearDown() override {
    (void)close(ends_[0]);
    end();
  }
  void send(const std::string& text) {
    ASSERT_EQ(write(ends_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void end() {
    if (ends_[1] >= 0) (void)close(ends_[1]);
    ends_[1] = -1;
  }
  std::array<int, 2> ends_{-1, -1};
};

TEST_F(Lines, AreParsedToEvents) {
  LineInput input(ends_[0]);
  EXPECT_TRUE(input.read(seconds(1), {}, S::Idle)->events.empty());
  send("go\nstop\n\nqu");
  EXPECT_EQ(input.read(seconds(1), {}, S::Idle)->events, (std::vector<E>{E::Go, E::Stop}));
  send("it\n");
  EXPECT_EQ(input.read(seconds(1), {}, S::Idle)->events, std::vector<E>{E::Quit});
}

TEST_F(Lines, DriveForHalfASecond) {
  LineInput input(ends_[0]);
  send("drive 0.3 -0.1\n");
  EXPECT_EQ(input.read(seconds(1), {}, S::Teaching)->command, (VelocityCommand{0.3, -0.1}));
  EXPECT_EQ(input.read(milliseconds(1500), {}, S::Teaching)->command, (VelocityCommand{0.3, -0.1}));
  EXPECT_EQ(input.read(milliseconds(1550), {}, S::Teaching)->command, VelocityCommand{});
}

TEST_F(Lines, StopAndGoEndADriveCommand) {
  LineInput input(ends_[0]);
  send("drive 0.3 0\nstop\n");
  EXPECT_EQ(input.read(seconds(1), {}, S::Teaching)->command, VelocityCommand{});
  send("drive 0.3 0\ngo\n");
  EXPECT_EQ(input.read(seconds(2), {}, S::Idle)->command, VelocityCommand{});
  EXPECT_EQ(input.read(seconds(2), {}, S::Teaching)->command, VelocityCommand{});
  send("stop\ndrive 0.2 0\n");
  EXPECT_EQ(input.read(seconds(3), {}, S::Teaching)->command, (VelocityCommand{0.2, 0}));
}

TEST_F(Lines, DriveCommandsStopAReplay) {
  LineInput input(ends_[0]);
  send("drive 0 0\n");
  EXPECT_TRUE(input.read(seconds(1), {}, S::Replaying)->events.empty());
  send("drive 0.3 0\n");
  EXPECT_EQ(input.read(seconds(1), {}, S::Replaying)->events, std::vector<E>{E::StickMoved});
}

TEST_F(Lines, InvalidLinesAreReportedAndMoveNothing) {
  LineInput input(ends_[0]);
  for (const char* line : {"drvie 0.3 0", "drive", "drive 0.3", "drive 0.3 0 1", "drive nan 0", "drive inf 0",
                           "drive 0.3,0", "GO", "go now"}) {
    send(std::string(line) + "\n");
    const auto request = input.read(seconds(1), {}, S::Teaching);
    ASSERT_EQ(request->messages.size(), 1U) << line;
    EXPECT_NE(request->messages[0].find(line), std::string::npos);
    testing::expect_on_page("inputs", request->messages[0]);
    EXPECT_EQ(request->command, VelocityCommand{}) << line;
    EXPECT_TRUE(request->events.empty()) << line;
  }
}

TEST_F(Lines, TheirEndEndsTheSession) {
  LineInput input(ends_[0]);
  end();
  EXPECT_EQ(input.read(seconds(1), {}, S::Teaching)->events, std::vector<E>{E::Quit});
  EXPECT_FALSE(input.usage().empty());
}

}  // namespace
}  // namespace waymark
