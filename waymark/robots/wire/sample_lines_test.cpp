#include "waymark/robots/wire/sample_lines.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/robot_lines.hpp"
#include "waymark/config/share.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

using std::chrono::seconds;

using ::testing::ElementsAre;

using ::testing::HasSubstr;

using ::testing::SizeIs;

SensorTime at_ms(int ms) { return SensorTime(seconds(1000) + milliseconds(ms)); }

TEST(ImageRing, KeepsTheLastTenImagesAndRemovesItsFolder) {
  std::filesystem::path folder;
  {
    auto ring = ImageRing::make();
    ASSERT_TRUE(ring);
    folder = ring->folder();
    std::vector<std::string> paths;
    for (std::uint8_t i = 0; i < 25; ++i)
      paths.push_back(ring->put(std::vector<std::uint8_t>(1000, i)).value());
    for (std::size_t i = 15; i < 25; ++i) {
      std::ifstream file(paths[i], std::ios::binary);
      const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
      EXPECT_EQ(bytes, std::string(1000, static_cast<char>(i)));
    }
    EXPECT_EQ(paths[5], paths[15]);
  }
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST(ImageRing, RemovesTheFoldersOfKilledProcesses) {
  const pid_t ended = fork();
  if (ended == 0) _exit(0);
  ASSERT_EQ(waitpid(ended, nullptr, 0), ended);
  const auto beside = ImageRing::make().value().folder().parent_path();
  const auto folder_of = [&](pid_t process) {
    return beside / fmt::format("waymark-images-{}-test", process);
  };
  const auto foreign = beside / fmt::format("waymark-images-x{}", ended);
  for (const auto& folder : {folder_of(ended), folder_of(getpid()), foreign})
    std::filesystem::create_directory(folder);
  std::ofstream(folder_of(ended) / "3.image") << "bytes";
  ASSERT_TRUE(ImageRing::make());
  EXPECT_FALSE(std::filesystem::exists(folder_of(ended)));
  EXPECT_TRUE(std::filesystem::exists(folder_of(getpid()))) << "this process is running";
  EXPECT_TRUE(std::filesystem::exists(foreign)) << "the name does not contain a process id";
  std::filesystem::remove(folder_of(getpid()));
  std::filesystem::remove(foreign);
}

TEST(SampleLines, LinesRoundTripToTheSameSample) {
  SampleLines lines("the network", "limo", {});
  test::RobotLines other;
  for (int i = 0; i < 5; ++i) {
    const Odometry sent{.stamp = at_ms(20 * i), .odom_T_base = SE2(0.1 * i, -0.2, 0.3), .speed_m_s = 0.4};
    const auto line = lines.line_of(sent, "/odom", milliseconds(20 * i), true);
    ASSERT_TRUE(line) << to_string(line.error());
    const auto read = std::get<Odometry>(other.read(*line));
    EXPECT_EQ(read.stamp, sent.stamp);
    EXPECT_EQ(read.odom_T_base, sent.odom_T_base);
    EXPECT_EQ(read.speed_m_s, sent.speed_m_s);
  }
  EXPECT_TRUE(lines.speaks());
}

TEST(SampleLines, RejectsSamplesThatTheReaderWouldReject) {
  SampleLines lines("the network", "limo", {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(lines.line_of(Odometry{.stamp = at_ms(0), .odom_T_base = SE2(nan, 0, 0)}, "/odom", {}, true));
  EXPECT_FALSE(
      lines.line_of(ImuSample{.stamp = at_ms(0), .angular_velocity_rad_s = {0, 0, nan}}, "/imu", {}, false));
}

TEST(SampleLines, MessagesMayQuoteInvalidUtf8) {
  SampleLines lines("the network", "limo", {});
  lines.drop("/tf", {ErrorCode::InvalidArgument, "frame '\xFE' has no parent", {}, {}});
  EXPECT_THAT(lines.take_reports(), ElementsAre(HasSubstr("has no parent")));
}

TEST(SampleLines, CountsAllDropsAndReportsThemLessAndLessOften) {
  SampleLines lines("the network", "limo", {});
  for (int i = 0; i < 1000; ++i)
    lines.drop("/imu", {ErrorCode::InvalidArgument, "its stamp is zero", {}, {}});
  lines.drop("/odom", {ErrorCode::InvalidArgument, "its stamp is zero", {}, {}});
  EXPECT_EQ(lines.dropped(), 1001U);
  // The 1st, 3rd, 10th, 30th, 100th, 300th and 1000th message on /imu, and one on /odom.
  EXPECT_THAT(lines.take_reports(), SizeIs(7 + 1));
  EXPECT_THAT(lines.take_reports(), SizeIs(0));
  for (int i = 0; i < 3; ++i) lines.report_once("two cameras publish");
  EXPECT_THAT(lines.take_reports(), ElementsAre(HasSubstr("two cameras publish")));
}

TEST(CameraDifference, ToleratesOnePercentOfTheFocalLength) {
  const RobotDescription robot = read_robot(find_shared("robots", "limo").value()).value();
  EXPECT_EQ(camera_difference(robot.camera, robot), "");
  const auto with = [&](double scale, double shift_px, int wider_px) {
    return std::visit(
        [&](auto model) {
          model.fx *= scale;
          model.fy *= scale;
          model.cx += shift_px;
          return CameraModel::make(model, robot.camera.width_px() + wider_px, robot.camera.height_px())
              .value();
        },
        robot.camera.projection());
  };
  EXPECT_EQ(camera_difference(with(1.005, 0, 0), robot), "");
  const std::string difference = camera_difference(with(1.05, 0, 0), robot);
  EXPECT_THAT(difference, HasSubstr(robot.model.name));
  testing::expect_on_page("robots", difference);
  EXPECT_NE(camera_difference(with(1, 20, 0), robot), "");
  EXPECT_NE(camera_difference(with(1, 0, 16), robot), "");
}

TEST(SampleLines, JoinsMessagesOfSeveralLines) {
  SampleLines lines("ROS 2", "robot", {});
  lines.report_once("no transform has the frame 'base'; the transforms are:\n  odom\n    link  (moves)");
  EXPECT_THAT(lines.take_reports(), ElementsAre(HasSubstr(": odom, link  (moves)")));
}

}  // namespace
}  // namespace waymark
