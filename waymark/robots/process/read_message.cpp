#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/json_depth.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/robots/process/base64.hpp"
#include "waymark/robots/process/message_fields.hpp"
#include "waymark/robots/process/read_tags.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {
namespace {

using nlohmann::json;

constexpr double kFar_m = 1e6;
constexpr double kFast = 100;
constexpr double kTurned_rad = 1e7;
constexpr std::int64_t kMostPixels = 50'000'000;
/// Corners of a tag stand at depth 5; the rest is for keys that are not known yet.
constexpr std::size_t kDeepest = 16;

RobotHello hello_of(MessageFields& fields) {
  RobotHello hello;
  hello.protocol_version = fields.integer("protocol_version", 1, 1'000'000);
  if (hello.protocol_version > kRobotProtocol)
    fields.wrong("protocol_version",
                 fmt::format("{} is newer than this program's {}", hello.protocol_version, kRobotProtocol),
                 "Update waymark, or let the robot speak the older version.");
  hello.name = fields.text("name");
  (void)fields.has("stamp_s");
  hello.lockstep = fields.flag_or_false("lockstep");
  hello.simulated_time = fields.flag_or_false("simulated_time");
  hello.simulated = fields.flag_or_false("simulated");
  if (fields.has("sends")) {
    const json* list = fields.array("sends", 100);
    for (const json& word : list != nullptr ? *list : json::array()) {
      if (word.is_string())
        hello.sends.push_back(word.get<std::string>());
      else
        fields.wrong("sends", "is not a list of words");
    }
  }
  return hello;
}

RobotLog log_of(MessageFields& fields) {
  (void)fields.has("stamp_s");  // may be there, says nothing
  return {fields.text("text")};
}

SE2 pose_of(MessageFields& fields) {
  const double x_m = fields.number("x_m", -kFar_m, kFar_m);
  const double y_m = fields.number("y_m", -kFar_m, kFar_m);
  return {SO2(fields.number("yaw_rad", -kTurned_rad, kTurned_rad)), Eigen::Vector2d(x_m, y_m)};
}

Sample odometry_of(MessageFields& fields) {
  Odometry odometry{.stamp = fields.stamp(), .odom_T_base = pose_of(fields)};
  odometry.speed_m_s = fields.number("speed_m_s", -kFast, kFast);
  odometry.yaw_rate_rad_s = fields.number("yaw_rate_rad_s", -kFast, kFast);
  return odometry;
}

Sample command_of(MessageFields& fields) {
  StampedCommand command{.stamp = fields.stamp()};
  command.command.speed_m_s = fields.number("speed_m_s", -kFast, kFast);
  command.command.yaw_rate_rad_s = fields.number("yaw_rate_rad_s", -kFast, kFast);
  return command;
}

Sample truth_of(MessageFields& fields) {
  const SensorTime stamp = fields.stamp();
  return TruthPose{stamp, lift(pose_of(fields))};
}

Sample wheels_of(MessageFields& fields) {
  const SensorTime stamp = fields.stamp();
  const double left_rad = fields.number("left_rad", -kTurned_rad, kTurned_rad);
  return WheelTicks{stamp, left_rad, fields.number("right_rad", -kTurned_rad, kTurned_rad)};
}

Eigen::Vector3d vector_of(MessageFields& fields, const char* key) {
  const std::vector<double> numbers = fields.numbers(key, 3);
  if (numbers.size() == 3) return {numbers[0], numbers[1], numbers[2]};
  fields.wrong(key, "is not a list of three numbers");
  return Eigen::Vector3d::Zero();
}

Sample imu_of(MessageFields& fields) {
  ImuSample imu{.stamp = fields.stamp()};
  imu.angular_velocity_rad_s = vector_of(fields, "angular_velocity_rad_s");
  imu.linear_acceleration_m_s2 = vector_of(fields, "linear_acceleration_m_s2");
  return imu;
}

Sample scan_of(MessageFields& fields) {
  LaserScan scan{.stamp = fields.stamp()};
  scan.angle_min_rad = fields.number("angle_min_rad", -10, 10);
  scan.angle_increment_rad = fields.number("angle_increment_rad", -1, 1);
  scan.time_increment_s = fields.number_or("time_increment_s", 0, 1, 0);
  scan.range_min_m = fields.number("range_min_m", 0, kFar_m);
  scan.range_max_m = fields.number("range_max_m", 0, kFar_m);
  for (const double range_m : fields.numbers("ranges_m", 100'000, true))
    scan.ranges_m.push_back(static_cast<float>(range_m));
  return scan;
}

Sample gamepad_of(MessageFields& fields) {
  GamepadState pad{.stamp = fields.stamp()};
  for (const double axis : fields.numbers("axes", 64)) pad.axes.push_back(static_cast<float>(axis));
  for (const double button : fields.numbers("buttons", 64)) pad.buttons.push_back(button != 0 ? 1 : 0);
  return pad;
}

Sample detections_of(MessageFields& fields) {
  const std::string camera = fields.camera();
  TagFrame frame{.stamp = fields.stamp(camera), .camera = camera};
  const json* tags = fields.array("tags", 1000);
  if (tags == nullptr) return frame;
  for (const json& tag : *tags) frame.detections.push_back(detection_of(fields, tag));
  return frame;
}

Sample tag_poses_of(MessageFields& fields) {
  const std::string camera = fields.camera();
  TagPoseFrame frame{.stamp = fields.stamp(camera), .camera = camera};
  const json* tags = fields.array("tags", 1000);
  if (tags == nullptr) return frame;
  for (const json& tag : *tags) frame.tags.push_back(tag_pose_of(fields, tag));
  return frame;
}

Sample image_of(MessageFields& fields) {
  const std::string camera = fields.camera();
  CameraFrame frame{.stamp = fields.stamp(camera), .camera = camera};
  const std::string path = fields.text("path", false);
  const std::string base64 = fields.text("jpeg_base64", false);
  if (fields.of_unknown_camera()) return frame;
  Result<Image> image = fail(ErrorCode::Unreadable, "neither 'path' nor 'jpeg_base64' is there");
  const DecodeOptions limits{.max_pixels = kMostPixels};
  if (!path.empty()) {
    image = read_image(path, limits);
  } else if (!base64.empty()) {
    const auto bytes = decode_base64(base64);
    image = bytes ? decode_image(*bytes, "jpeg_base64", limits)
                  : Result<Image>(fail(ErrorCode::Unreadable, "is not base64 (RFC 4648, with padding)"));
  }
  if (image)
    frame.image = std::move(*image);
  else if (path.empty() && base64.empty())
    fields.wrong("path", to_string(image.error()));
  else
    fields.leave_out(to_string(image.error()));
  return frame;
}

using ReadSample = Sample (*)(MessageFields&);
const std::map<std::string, ReadSample>& sample_types() {
  static const std::map<std::string, ReadSample> kTypes = {
      {"odometry", odometry_of},   {"truth", truth_of},
      {"wheels", wheels_of},       {"imu", imu_of},
      {"scan", scan_of},           {"image", image_of},
      {"gamepad", gamepad_of},     {"detections", detections_of},
      {"tag_poses", tag_poses_of}, {"command", command_of}};
  return kTypes;
}

}  // namespace

void RobotMessageReader::warn_once(const std::string& words) {
  // The line differs each time, the rest does not.
  const std::string what = words.substr(words.find(':') == std::string::npos ? 0 : words.find(':'));
  constexpr std::size_t kMostWarnings = 50;
  if (said_.size() < kMostWarnings && said_.insert(what).second) warnings_.push_back(words);
}

/// Said at once, and again each time their number has doubled.
void RobotMessageReader::warn_of_left_out(std::int64_t line, const MessageFields& fields) {
  unsigned& count = fields.of_unknown_camera() ? unknown_cameras_ : unreadable_pictures_;
  ++count;
  if ((count & (count - 1)) != 0) return;
  const char* what = fields.of_unknown_camera() ? "lines of cameras that the robot does not have were"
                                                : "pictures could not be read and were";
  warnings_.push_back(
      fmt::format("line {}: {} {} left out, the last one: {}", line, count, what, fields.left_out()));
}

Result<std::optional<RobotMessage>> RobotMessageReader::read(const Line& line) {
  const Place place{.source = name_, .line = line.number};
  const auto bad = [&](std::string words, std::string hint = {}) {
    return fail(ErrorCode::Unreadable, std::move(words), place, std::move(hint));
  };
  if (line.too_long) return bad(fmt::format("is longer than {} bytes", kLongestLine));
  if (line.text.find_first_not_of(" \t\r") == std::string::npos) return std::optional<RobotMessage>();
  if (json_depth(line.text, kDeepest) > kDeepest)
    return bad(fmt::format("has lists or objects more than {} deep in each other", kDeepest),
               "No message of the protocol is deeper than 5.");
  const json object = json::parse(line.text, nullptr, false);
  if (object.is_discarded() || !object.is_object())
    return bad(
        fmt::format("is no JSON object: '{}'", line.text.substr(0, 60)),
        line.text.find("NaN") != std::string::npos || line.text.find("Infinity") != std::string::npos
            ? "JSON has neither NaN nor Infinity: let the robot leave out a sample that it does not know."
            : "Standard output carries messages alone: let the robot print words on standard error.");
  const auto type = object.find("type");
  if (type == object.end() || !type->is_string()) return bad("has no 'type'");
  const auto name = type->get<std::string>();
  MessageFields fields(*this, object, name, line.number);
  std::optional<RobotMessage> message;
  if (name == "hello")
    message = hello_of(fields);
  else if (name == "log")
    message = log_of(fields);
  else if (!greeted_)
    return bad(fmt::format("'{}' came before 'hello'", name),
               R"(The first line is {"type":"hello","protocol_version":1,"name":"my robot"}.)");
  else if (name == "step")
    message = RobotStep{fields.integer("step", 1, std::int64_t{1} << 52U), fields.stamp()};
  else if (const auto known = sample_types().find(name); known != sample_types().end())
    message = known->second(fields);
  else
    warn_once(fmt::format("line {}: lines of type '{}' are not known and passed over", line.number, name));
  if (!message) return message;
  if (Status status = fields.finish(); !status) return tl::unexpected(status.error());
  if (!fields.left_out().empty()) {
    warn_of_left_out(line.number, fields);
    return std::optional<RobotMessage>();
  }
  greeted_ = greeted_ || name == "hello";
  return message;
}

RobotOrderLine parse_order_line(const std::string& text) {
  RobotOrderLine order;
  if (json_depth(text, kDeepest) > kDeepest) return order;
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object()) return order;
  const std::string type = object.value("type", json()).is_string() ? object["type"].get<std::string>() : "";
  const auto number = [&](const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_number() ? found->get<double>() : 0.0;
  };
  if (type == "hello") {
    order.kind = RobotOrderLine::Kind::Hello;
    const auto found = object.find("listen_only");
    order.listen_only = found != object.end() && found->is_boolean() && found->get<bool>();
  }
  if (type == "bye") order.kind = RobotOrderLine::Kind::Bye;
  if (type != "velocity") return order;
  order.kind = RobotOrderLine::Kind::Velocity;
  order.command = {number("speed_m_s"), number("yaw_rate_rad_s")};
  order.step = static_cast<std::int64_t>(number("step"));
  order.by_watchdog = object.contains("stop");
  return order;
}

}  // namespace waymark
