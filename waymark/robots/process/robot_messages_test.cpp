#include "waymark/robots/process/robot_messages.hpp"

#include <limits>

#include <sys/stat.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr const char* kHello = R"({"type":"hello","protocol_version":1,"name":"tiny"})";

/// A reader that has received the hello; line numbers continue at 2.
class Reader {
 public:
  Reader() { EXPECT_TRUE(reader_.read({1, kHello, false})); }
  Result<std::optional<RobotMessage>> read(const std::string& text) {
    return reader_.read({++line_, text, false});
  }
  std::string error(const std::string& text) {
    const auto message = read(text);
    return message ? "accepted" : to_string(message.error());
  }
  Sample sample(const std::string& line) {
    auto message = read(line.substr(0, line.size() - 1));
    EXPECT_TRUE(message) << to_string(message.error());
    return message && *message ? std::get<Sample>(**message) : Sample(TagFrame{});
  }
  std::vector<std::string> warnings() { return reader_.take_warnings(); }

 private:
  RobotMessageReader reader_{"process:tiny"};
  std::int64_t line_ = 1;
};

TEST(Base64, FollowsRfc4648) {
  // RFC 4648, section 10.
  for (const auto& [plain, text] : std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                                                    {"f", "Zg=="},
                                                                                    {"fo", "Zm8="},
                                                                                    {"foo", "Zm9v"},
                                                                                    {"foob", "Zm9vYg=="},
                                                                                    {"foobar", "Zm9vYmFy"}}) {
    const std::vector<std::uint8_t> bytes(plain.begin(), plain.end());
    EXPECT_EQ(encode_base64(bytes), text);
    EXPECT_EQ(decode_base64(text), bytes);
  }
  for (const char* bad :
       {"Zg=", "Zg", "Z===", "Zh==", "Zm9=", "Zm 9", "====", "Zg==Zg==", "\xff\xff\xff\xff"})
    EXPECT_FALSE(decode_base64(bad)) << bad;
  Random random(5);
  for (std::size_t size = 0; size < 200; ++size) {
    std::vector<std::uint8_t> bytes(size);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
    EXPECT_EQ(decode_base64(encode_base64(bytes)), bytes);
  }
}

TEST(RobotMessages, ReadWhatTheyWrite) {
  Reader reader;
  const SensorTime stamp(Duration(1'234'567'890'123'456'789));
  const Odometry odometry{stamp, SE2(SO2(0.3), Eigen::Vector2d(0.1 + 0.2, -7)), 0.25, -0.5};
  const auto odometry_back = std::get<Odometry>(reader.sample(to_line(Sample(odometry))));
  EXPECT_EQ(odometry_back.stamp, stamp) << "to the nanosecond";
  EXPECT_EQ(odometry_back.odom_T_base.x(), odometry.odom_T_base.x());
  EXPECT_NEAR(odometry_back.odom_T_base.rotation().angle(), 0.3, 1e-15);
  EXPECT_EQ(odometry_back.yaw_rate_rad_s, -0.5);
  const auto wheels = std::get<WheelTicks>(reader.sample(to_line(Sample(WheelTicks{stamp, 1.5, -2.5}))));
  EXPECT_EQ(wheels.right_rad, -2.5);
  const ImuSample imu{stamp, {0.1, 0.2, 0.3}, {0, 0, 9.81}};
  EXPECT_EQ(std::get<ImuSample>(reader.sample(to_line(Sample(imu)))).angular_velocity_rad_s,
            imu.angular_velocity_rad_s);
  const LaserScan scan{stamp, -1, 0.5, 0, 0.1, 8, {1.5F, std::numeric_limits<float>::infinity(), 2.25F}};
  EXPECT_EQ(std::get<LaserScan>(reader.sample(to_line(Sample(scan)))).ranges_m, scan.ranges_m);
  const TruthPose truth{stamp, lift(odometry.odom_T_base)};
  EXPECT_TRUE(
      (std::get<TruthPose>(reader.sample(to_line(Sample(truth)))).map_T_base.inverse() * truth.map_T_base)
          .log()
          .isZero(1e-12));
  TagFrame frame{.stamp = stamp};
  frame.detections.push_back({.tag = *parse_tag_id("tag36h11:7"), .hamming = 1, .decision_margin = 55});
  for (auto& corner : frame.detections[0].corners_px) corner = {1.0 / 3, 2.0 / 3};
  const auto frame_back = std::get<TagFrame>(reader.sample(to_line(Sample(frame))));
  ASSERT_EQ(frame_back.detections.size(), 1U);
  EXPECT_EQ(frame_back.detections[0].tag, frame.detections[0].tag);
  EXPECT_EQ(frame_back.detections[0].corners_px, frame.detections[0].corners_px);
  EXPECT_TRUE(usable_corners(frame_back.detections[0]));
  frame.detections[0].corner_state = CornerState::Unreliable;
  EXPECT_FALSE(usable_corners(std::get<TagFrame>(reader.sample(to_line(Sample(frame)))).detections.at(0)));
  const SE3 cam_T_tag(SO3::from_rpy(0.1, -0.7, 2), Eigen::Vector3d(-0.257, 0.049, 1.635));
  const TagPoseFrame poses{stamp, "cam", {{{FamilyId::TagCustom48h12, 7}, cam_T_tag}}};
  const auto poses_back = std::get<TagPoseFrame>(reader.sample(to_line(Sample(poses))));
  ASSERT_EQ(poses_back.tags.size(), 1U);
  EXPECT_EQ(poses_back.stamp, stamp);
  EXPECT_EQ(poses_back.tags[0].tag, poses.tags[0].tag);
  EXPECT_LT((poses_back.tags[0].cam_T_tag.inverse() * cam_T_tag).log().norm(), 1e-12);
  const GamepadState pad{stamp, {0.5F, -1}, {0, 1}};
  EXPECT_EQ(std::get<GamepadState>(reader.sample(to_line(Sample(pad)))).buttons, pad.buttons);
  EXPECT_EQ(to_line(Sample(StampedCommand{})), "")
      << "only the simulated robot has commands, and it receives them";
  const auto command = std::get<StampedCommand>(
      reader.sample(R"({"type":"command","stamp_s":2.5,"speed_m_s":0.3,"yaw_rate_rad_s":-1.25})"
                    "\n"));
  EXPECT_EQ(command.stamp, SensorTime(Duration(2'500'000'000)));
  EXPECT_EQ(command.command, (VelocityCommand{0.3, -1.25}));
}

TEST(RobotMessages, InvalidTagPosesAreErrors) {
  const auto error = [](const std::string& tag) {
    Reader reader;
    return reader.error(R"({"type":"tag_poses","stamp_s":1,"tags":[)" + tag + "]}");
  };
  const std::string place = R"("position_m":[0,0,1],)";
  const std::string name = R"("tag":"tag36h11:7",)";
  EXPECT_THAT(error(R"({"position_m":[0,0,1],"rotation_xyzw":[0,0,0,1]})"), HasSubstr("'tag'"));
  EXPECT_THAT(error("{" + name + R"("rotation_xyzw":[0,0,0,1]})"), HasSubstr("'position_m'"));
  EXPECT_THAT(error("{" + name + R"("position_m":[0,1e9,1],"rotation_xyzw":[0,0,0,1]})"),
              HasSubstr("'position_m'"));
  EXPECT_THAT(error("{" + name + place + R"("rotation_xyzw":[0,0,0]})"), HasSubstr("'rotation_xyzw'"));
  EXPECT_THAT(error("{" + name + place + R"("rotation_xyzw":[0,0,0,2]})"), HasSubstr("(tag_poses.tags)"));
  EXPECT_THAT(error("7"), HasSubstr("'tag'"));
  for (const char* tag : {"7", R"({"tag":"tag36h11:7","position_m":[0,0,1],"rotation_xyzw":[0,0,0,2]})"})
    testing::expect_on_page("robots", error(tag));
}

TEST(RobotMessages, ReadsImagesFromBase64) {
  Reader reader;
  Image grey(64, 48);
  const auto jpeg = encode_jpeg(grey, 90);
  ASSERT_TRUE(jpeg);
  const auto frame = std::get<CameraFrame>(reader.sample(to_line(Sample(CameraFrame{.stamp = {}}), *jpeg)));
  EXPECT_EQ(frame.image.width(), 64);
  EXPECT_THAT(reader.error(R"({"type":"image","stamp_s":1})"), HasSubstr("'jpeg_base64'"));
}

TEST(RobotMessages, DetectionsNameTheirCamera) {
  RobotMessageReader reader("robot", {"front", "rear"});
  std::int64_t number = 0;
  const auto read = [&](const std::string& text) {
    return reader.read(Line{.number = ++number, .text = text}).value();
  };
  (void)read(R"({"type":"hello","protocol_version":1,"name":"two"})");
  const auto frame_of = [](const std::optional<RobotMessage>& message) {
    return std::get<TagFrame>(std::get<Sample>(message.value()));
  };
  EXPECT_EQ(frame_of(read(R"({"type":"detections","stamp_s":1,"camera":"rear","tags":[]})")).camera, "rear");
  EXPECT_EQ(frame_of(read(R"({"type":"detections","stamp_s":0.9,"camera":"front","tags":[]})")).camera,
            "front")
      << "each camera has its own stream";
  EXPECT_EQ(
      frame_of(read(to_line(Sample(TagFrame{.stamp = SensorTime(seconds(2)), .camera = "rear"})))).camera,
      "rear");
  EXPECT_FALSE(reader.read(
      Line{.number = ++number, .text = R"({"type":"detections","stamp_s":1,"camera":"rear","tags":[]})"}))
      << "the timestamp decreased";
}

TEST(RobotMessages, SkipsAndCountsLinesOfUnknownCameras) {
  RobotMessageReader reader("robot", {"front", "rear"});
  std::int64_t number = 0;
  const auto warning_of = [&](const std::string& text) {
    const auto message = reader.read(Line{.number = ++number, .text = text});
    EXPECT_TRUE(message && !*message) << text;
    const auto warnings = reader.take_warnings();
    return warnings.empty() ? std::string() : warnings.at(0);
  };
  (void)reader.read(
      Line{.number = ++number, .text = R"({"type":"hello","protocol_version":1,"name":"two"})"});
  const std::string left = R"({"type":"detections","stamp_s":1,"camera":"left","tags":[]})";
  const std::string first = warning_of(left);
  for (const char* part : {"'left'", "front, rear", "1 line"}) EXPECT_THAT(first, HasSubstr(part));
  testing::expect_on_page("robots", first);
  EXPECT_THAT(warning_of(R"({"type":"image","stamp_s":1,"camera":"left","path":"/no/such"})"),
              HasSubstr("2 lines"));
  EXPECT_EQ(warning_of(left), "") << "not each time";
  const std::string unnamed = warning_of(R"({"type":"detections","stamp_s":1,"tags":[]})");
  EXPECT_THAT(unnamed, HasSubstr("4 lines"));
  testing::expect_on_page("robots", unnamed);
}

TEST(RobotMessages, ALineWithoutCameraIsOfTheOnlyCamera) {
  RobotMessageReader reader("robot", {"front"});
  (void)reader.read(Line{.number = 1, .text = R"({"type":"hello","protocol_version":1,"name":"one"})"});
  const auto message =
      reader.read(Line{.number = 2, .text = R"({"type":"detections","stamp_s":1,"tags":[]})"});
  ASSERT_TRUE(message && *message);
  EXPECT_EQ(std::get<TagFrame>(std::get<Sample>(**message)).camera, "front");
  const std::string unnamed = to_line(Sample(TagFrame{}));
  EXPECT_EQ(unnamed.find("camera"), std::string::npos) << "the default camera is not written";
}

TEST(RobotMessages, SkipsAndCountsUnreadableImages) {
  Reader reader;
  const auto warning_of = [&](const std::string& line) {
    const auto message = reader.read(line);
    EXPECT_TRUE(message && !*message) << line;
    const auto warnings = reader.warnings();
    return warnings.empty() ? std::string() : warnings.at(0);
  };
  const std::string torn = R"({"type":"image","stamp_s":1,"jpeg_base64":"AAAA"})";
  EXPECT_THAT(warning_of(R"({"type":"image","stamp_s":1,"path":"/no/such/image.pgm"})"),
              HasSubstr("/no/such/image.pgm"));
  EXPECT_THAT(warning_of(R"({"type":"image","stamp_s":1,"jpeg_base64":"?"})"), HasSubstr("base64"));
  EXPECT_EQ(warning_of(torn), "") << "not each time";
  const std::string fourth = warning_of(torn);
  EXPECT_THAT(fourth, HasSubstr(" 4 "));
  testing::expect_on_page("robots", fourth);
  Image grey(64, 48);
  EXPECT_EQ(std::get<CameraFrame>(reader.sample(to_line(Sample(CameraFrame{.stamp = SensorTime(seconds(2))}),
                                                        encode_jpeg(grey, 90).value())))
                .image.width(),
            64)
      << "the next image is read";
  EXPECT_THAT(reader.error(R"({"type":"image","stamp_s":1.5,"jpeg_base64":"AAAA"})"), HasSubstr("0.500 s"))
      << "errors in the line itself are still errors";
}

TEST(RobotMessages, ErrorsOfBadLinesContainLineAndKey) {
  Reader reader;
  const std::string text = reader.error("motors on");
  EXPECT_THAT(text, HasSubstr("process:tiny:2: "));
  EXPECT_THAT(text, HasSubstr("'motors on'"));
  testing::expect_on_page("robots", text);
  EXPECT_THAT(reader.error(R"({"type":"odometry","stamp_s":1,"x_m":NaN})"), HasSubstr("NaN"));
  EXPECT_THAT(reader.error(R"({"type":"wheels","stamp_s":1,"left_rad":1e999,"right_rad":0})"),
              HasSubstr("process:tiny:4"));
  EXPECT_THAT(reader.error(R"({"type":"wheels","stamp_s":1,"left_rad":"1","right_rad":0})"),
              HasSubstr("(wheels.left_rad): \"1\""));
  EXPECT_THAT(reader.error(R"({"type":"wheels","stamp_s":1,"left_rd":1,"right_rad":0})"),
              HasSubstr("'left_rd'"));
  EXPECT_THAT(reader.error(R"({"type":"wheels","stamp_s":-1,"left_rad":1,"right_rad":0})"),
              HasSubstr("(wheels.stamp_s): -1"));
  EXPECT_THAT(reader.error(R"({"no":"type"})"), HasSubstr("'type'"));
  EXPECT_THAT(
      reader.error(
          R"({"type":"imu","stamp_s":1,"angular_velocity_rad_s":[1,2],"linear_acceleration_m_s2":[0,0,0]})"),
      HasSubstr("(imu.angular_velocity_rad_s)"));
  EXPECT_THAT(
      reader.error(R"({"type":"detections","stamp_s":1,"tags":[{"tag":"36h11","corners_px":[[1,2]]}]})"),
      HasSubstr("tag36h11:7"));
  EXPECT_THAT(reader.error(R"({"type":"detections","stamp_s":1,"tags":[3]})"), HasSubstr("detections.tags"));
  EXPECT_THAT(reader.error(R"({"type":"hello","protocol_version":2,"name":"new"})"),
              HasSubstr("(hello.protocol_version): 2"));
  for (const char* line :
       {R"({"type":"wheels","stamp_s":1,"left_rad":"1","right_rad":0})",
        R"({"type":"wheels","stamp_s":1,"left_rd":1,"right_rad":0})",
        R"({"type":"wheels","stamp_s":-1,"left_rad":1,"right_rad":0})", R"({"no":"type"})",
        R"({"type":"imu","stamp_s":1,"angular_velocity_rad_s":[1,2],"linear_acceleration_m_s2":[0,0,0]})",
        R"({"type":"detections","stamp_s":1,"tags":[{"tag":"tag36h11:7","corners_px":[[1,2]]}]})",
        R"({"type":"hello","protocol_version":2,"name":"new"})", R"({"type":"image","stamp_s":1})",
        R"({"type":"odometry","stamp_s":1,"x_m":NaN})"})
    testing::expect_on_page("robots", Reader().error(line));
  RobotMessageReader ungreeted("r");
  EXPECT_FALSE(ungreeted.read({1, R"({"type":"wheels","stamp_s":1,"left_rad":1,"right_rad":0})", false}));
  EXPECT_FALSE(ungreeted.read({2, "{", true})) << "too long";
}

TEST(RobotMessages, RejectsStampsThatGoBack) {
  Reader reader;
  const auto wheels = [](double stamp_s) {
    return R"({"type":"wheels","stamp_s":)" + std::to_string(stamp_s) + R"(,"left_rad":1,"right_rad":0})";
  };
  EXPECT_TRUE(reader.read(wheels(5)));
  EXPECT_TRUE(reader.read(wheels(5)));
  EXPECT_TRUE(reader.read(R"({"type":"detections","stamp_s":4.9,"tags":[]})"))
      << "another stream may be behind";
  const std::string error = reader.error(wheels(4.5));
  EXPECT_THAT(error, HasSubstr("0.500 s"));
  testing::expect_on_page("robots", error);
}

TEST(RobotMessages, WarnsOnceAboutUnknownKeysAndTypes) {
  Reader reader;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(reader.read(R"({"type":"wheels","stamp_s":1,"left_rad":1,"right_rad":0,"mood":"good"})"));
    const auto unknown = reader.read(R"({"type":"sonar","stamp_s":1})");
    ASSERT_TRUE(unknown);
    EXPECT_FALSE(*unknown);
    EXPECT_FALSE(reader.read("").value());
  }
  const auto warnings = reader.warnings();
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(warnings[0], HasSubstr("'mood' of wheels"));
  EXPECT_THAT(warnings[1], HasSubstr("'sonar'"));
  for (const std::string& warning : warnings) testing::expect_on_page("robots", warning);
}

TEST(RobotMessages, RejectsDeepNesting) {
  Reader reader;
  for (const std::size_t depth : {std::size_t{17}, std::size_t{60'000}, std::size_t{1'000'000}}) {
    const std::string nested = std::string(depth, '[') + std::string(depth, ']');
    for (const std::string& line :
         {R"({"type":"log","text":)" + nested + "}", R"({"type":"wheels","stamp_s":)" + nested + "}",
          R"({"type":"step","step":)" + nested + "}", R"({"type":"log","text":"","mood":)" + nested + "}",
          R"({"type":"detections","stamp_s":1,"tags":)" + nested + "}", nested})
      EXPECT_THAT(reader.error(line), HasSubstr(" 16 ")) << depth;
    EXPECT_EQ(parse_order_line(nested).kind, RobotOrderLine::Kind::Other);
  }
  const std::string objects = R"({"type":"log","text":)";
  std::string deep;
  for (int i = 0; i < 20'000; ++i) deep += R"({"a":)";
  EXPECT_THAT(reader.error(objects + deep), HasSubstr(" 16 "));
}

TEST(RobotMessages, SkipsAnImagePathThatIsAPipe) {
  Reader reader;
  const std::string name = ::testing::TempDir() + "waymark-image-pipe";
  (void)unlink(name.c_str());
  ASSERT_EQ(mkfifo(name.c_str(), 0600), 0);
  const auto message = reader.read(R"({"type":"image","stamp_s":1,"path":")" + name + "\"}");
  EXPECT_TRUE(message && !*message) << "skipped like any unreadable image";
  EXPECT_THAT(reader.warnings(), ::testing::ElementsAre(HasSubstr("pipe")));
  (void)unlink(name.c_str());
}

TEST(RobotMessages, ReadsOrRejectsAnyBytes) {
  const std::string good =
      R"({"type":"detections","stamp_s":1,"tags":[{"tag":"tag36h11:7","corners_px":[[1,2],[3,4],[5,6],[7,8]]}]})";
  Random random(11);
  Reader reader;
  for (int i = 0; i < 3000; ++i) {
    std::string line = good;
    for (int k = 0; k < 3; ++k) line[random.index(line.size())] = static_cast<char>(random.index(256));
    (void)reader.read(line);
  }
  EXPECT_FALSE(reader.read(std::string(200000, '[')));
  EXPECT_LE(reader.warnings().size(), 50U);
}

}  // namespace
}  // namespace waymark
