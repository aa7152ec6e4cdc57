#include "waymark/robots/process/robot_messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/base/json_depth.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kNone = 255;

constexpr std::array<std::uint8_t, 256> values_of_characters() {
  std::array<std::uint8_t, 256> values{};
  values.fill(kNone);
  for (std::size_t i = 0; i < kAlphabet.size(); ++i)
    values[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::uint8_t>(i);
  return values;
}

constexpr std::array<std::uint8_t, 256> kValues = values_of_characters();

}  // namespace

std::string encode_base64(std::span<const std::uint8_t> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8U) | (k < there ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= there ? kAlphabet[(group >> (18U - 6U * static_cast<unsigned>(k))) & 63U] : '=';
  }
  return text;
}

std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text) {
  if (text.size() % 4 != 0) return std::nullopt;
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    const std::size_t there = i + 4 == text.size() ? 4 - padding : 4;
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint8_t value = k < there ? kValues[static_cast<unsigned char>(text[i + k])] : 0;
      if (value == kNone) return std::nullopt;
      group = (group << 6U) | value;
    }
    const std::uint32_t unused = there == 2 ? 0xffffU : there == 3 ? 0xffU : 0U;
    if ((group & unused) != 0) return std::nullopt;  // bits that are always zero in encoded data
    for (std::size_t k = 0; k + 1 < there; ++k)
      bytes.push_back(static_cast<std::uint8_t>(group >> (16U - 8U * static_cast<unsigned>(k))));
  }
  return bytes;
}

using nlohmann::json;

/// Reads the keys of one line. The first error is kept; any values read after it are zero.
class MessageFields {
 public:
  MessageFields(RobotMessageReader& reader, const json& object, std::string type, std::int64_t line);

  [[nodiscard]] double number(const char* key, double min, double max);
  [[nodiscard]] double number_or(const char* key, double min, double max, double otherwise);
  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t min, std::int64_t max);
  [[nodiscard]] std::string text(const char* key, bool needed = true);
  [[nodiscard]] bool flag_or_false(const char* key);
  /// stamp_s or stamp_ns. Fails if it decreases within the stream; each camera is a separate stream.
  [[nodiscard]] SensorTime stamp(const std::string& camera = {});
  /// The camera to which a line refers; the only camera if the line does not contain one. The line is skipped
  /// if its camera is ambiguous or unknown.
  [[nodiscard]] std::string camera();
  /// A list of at most `max_count` numbers. With `allow_null`, null means infinity.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t max_count, bool allow_null = false);
  [[nodiscard]] const json* array(const char* key, std::size_t max_count);
  [[nodiscard]] bool has(const char* key);

  void wrong(const std::string& key, const std::string& message, const std::string& hint = {});
  /// Marks a line that is valid but has unusable content, so that it is skipped, counted and reported.
  void skip(std::string reason) { skip_reason_ = std::move(reason); }
  [[nodiscard]] bool of_unknown_camera() const { return unknown_camera_; }
  [[nodiscard]] const std::string& skip_reason() const { return skip_reason_; }
  /// Warns about unused keys; fails with the first error.
  [[nodiscard]] Status finish();

 private:
  [[nodiscard]] const json* find(const char* key, bool needed);
  [[nodiscard]] double checked(const json& value, const char* key, double min, double max);

  RobotMessageReader& reader_;
  const json& object_;
  std::string type_;
  std::int64_t line_;
  std::set<std::string> taken_{"type"};
  Status status_{};
  std::string skip_reason_{};
  bool unknown_camera_ = false;
};

MessageFields::MessageFields(RobotMessageReader& reader, const json& object, std::string type,
                             std::int64_t line)
    : reader_(reader), object_(object), type_(std::move(type)), line_(line) {}

void MessageFields::wrong(const std::string& key, const std::string& message, const std::string& hint) {
  if (status_)
    status_ = fail(ErrorCode::Unreadable, message,
                   {.source = reader_.name_, .line = line_, .key = type_ + "." + key}, hint);
}

const json* MessageFields::find(const char* key, bool needed) {
  taken_.insert(key);
  const auto found = object_.find(key);
  if (found != object_.end()) return &*found;
  if (needed) {
    std::vector<std::string> there;
    for (const auto& [name, value] : object_.items()) {
      if (name != "type") there.push_back(name);
    }
    const std::string near = nearest_word(key, there);
    wrong(key, "is missing",
          near.empty() ? "" : fmt::format("Did you mean '{}'? Keys end with their unit.", near));
  }
  return nullptr;
}

bool MessageFields::has(const char* key) { return find(key, false) != nullptr; }

double MessageFields::checked(const json& value, const char* key, double min, double max) {
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!value.is_number())
    wrong(key, fmt::format("{} is not a number", value.dump().substr(0, 40)));
  else if (!(number >= min && number <= max))
    wrong(key, fmt::format("{} is outside [{}, {}]", number, min, max));
  else
    return number;
  return 0;
}

double MessageFields::number(const char* key, double min, double max) {
  const json* value = find(key, true);
  return value == nullptr ? 0 : checked(*value, key, min, max);
}

double MessageFields::number_or(const char* key, double min, double max, double otherwise) {
  const json* value = find(key, false);
  return value == nullptr ? otherwise : checked(*value, key, min, max);
}

std::int64_t MessageFields::integer(const char* key, std::int64_t min, std::int64_t max) {
  const json* value = find(key, true);
  if (value == nullptr) return 0;
  if (!value->is_number_integer() || value->get<std::int64_t>() < min || value->get<std::int64_t>() > max) {
    wrong(key, fmt::format("{} is not an integer in [{}, {}]", value->dump().substr(0, 40), min, max));
    return 0;
  }
  return value->get<std::int64_t>();
}

std::string MessageFields::text(const char* key, bool needed) {
  const json* value = find(key, needed);
  if (value == nullptr) return {};
  if (value->is_string()) return value->get<std::string>();
  wrong(key, fmt::format("{} is not a string", value->dump().substr(0, 40)));
  return {};
}

bool MessageFields::flag_or_false(const char* key) {
  const json* value = find(key, false);
  if (value == nullptr) return false;
  if (!value->is_boolean()) wrong(key, "is neither true nor false");
  return value->is_boolean() && value->get<bool>();
}

std::string MessageFields::camera() {
  const std::vector<std::string>& cameras = reader_.cameras_;
  const bool named = has("camera");
  std::string name = named ? text("camera") : std::string();
  if (!named && cameras.size() < 2) return cameras.empty() ? "cam" : cameras.front();
  if (cameras.empty() || std::ranges::find(cameras, name) != cameras.end()) return name;
  unknown_camera_ = true;
  skip(fmt::format("{}; the robot has {}", named ? fmt::format("unknown camera '{}'", name) : "no 'camera'",
                   fmt::join(cameras, ", ")));
  return name;
}

SensorTime MessageFields::stamp(const std::string& camera) {
  constexpr std::int64_t kMaxStamp_ns = std::int64_t{1} << 62U;
  constexpr double kMaxStamp_s = 4e9;
  SensorTime stamp{};
  if (has("stamp_ns"))
    stamp = SensorTime(Duration(integer("stamp_ns", 0, kMaxStamp_ns)));
  else
    stamp = SensorTime(Duration(std::llround(number("stamp_s", 0, kMaxStamp_s) * 1e9)));
  if (!status_) return stamp;
  auto& newest = reader_.newest_.try_emplace(type_ + "/" + camera, stamp).first->second;
  if (stamp < newest)
    wrong("stamp_s",
          fmt::format("the robot's clock went back by {:.3f} s since the previous line of this type",
                      to_seconds(newest - stamp)),
          "Use stamps of a steady clock (time.monotonic() in Python).");
  newest = stamp;
  return stamp;
}

const json* MessageFields::array(const char* key, std::size_t max_count) {
  const json* value = find(key, true);
  if (value == nullptr) return nullptr;
  if (value->is_array() && value->size() <= max_count) return value;
  wrong(key, value->is_array() ? fmt::format("has {} entries, more than {}", value->size(), max_count)
                               : std::string("is not a list"));
  return nullptr;
}

std::vector<double> MessageFields::numbers(const char* key, std::size_t max_count, bool allow_null) {
  constexpr double kMaxNumber = 1e12;
  std::vector<double> numbers;
  const json* list = array(key, max_count);
  if (list == nullptr) return numbers;
  for (const json& value : *list) {
    if (allow_null && value.is_null())
      numbers.push_back(std::numeric_limits<double>::infinity());
    else
      numbers.push_back(checked(value, key, -kMaxNumber, kMaxNumber));
  }
  return numbers;
}

Status MessageFields::finish() {
  if (!status_) return status_;
  for (const auto& [key, value] : object_.items()) {
    if (!taken_.contains(key))
      reader_.warn_once(fmt::format("line {}: unknown key '{}' of {}; ignored", line_, key, type_));
  }
  return {};
}

namespace {

constexpr double kMaxDistance_m = 1e6;

TagId id_of(MessageFields& fields, const json& tag) {
  const bool named = tag.is_object() && tag.contains("tag") && tag["tag"].is_string();
  const auto id = parse_tag_id(named ? tag["tag"].get<std::string>() : std::string());
  if (id) return *id;
  if (named)
    fields.wrong("tags", id.error().message, id.error().hint);
  else
    fields.wrong("tags", "'tag' is not a tag name such as \"tag36h11:7\"");
  return {};
}

/// The numbers in a list; empty if there are not exactly `count` of them.
std::vector<double> entries(const json& object, const char* key, std::size_t count) {
  const auto list = object.is_object() ? object.find(key) : object.end();
  std::vector<double> numbers;
  if (!object.is_object() || list == object.end() || !list->is_array() || list->size() != count) return {};
  for (const json& number : *list)
    if (number.is_number()) numbers.push_back(number.get<double>());
  return numbers.size() == count ? numbers : std::vector<double>();
}

/// A tag in a `detections` line. Reports errors to `fields`.
TagDetection detection_of(MessageFields& fields, const json& tag) {
  TagDetection detection;
  const json none;
  const auto at = [&](const char* key) -> const json& {
    const auto found = tag.is_object() ? tag.find(key) : tag.end();
    return tag.is_object() && found != tag.end() ? *found : none;
  };
  detection.tag = id_of(fields, tag);
  const json& corners = at("corners_px");
  const auto is_point = [](const json& point) {
    return point.is_array() && point.size() == 2 && point[0].is_number() && point[1].is_number() &&
           std::abs(point[0].get<double>()) < 1e5 && std::abs(point[1].get<double>()) < 1e5;
  };
  if (!corners.is_array() || corners.size() != 4 || !std::ranges::all_of(corners, is_point)) {
    fields.wrong("tags", "'corners_px' is not four points [x, y]",
                 "The order is top left, top right, bottom right, bottom left of the printed tag.");
    return detection;
  }
  for (std::size_t i = 0; i < 4; ++i)
    detection.corners_px[i] = {corners[i][0].get<double>(), corners[i][1].get<double>()};
  if (at("hamming").is_number_integer()) detection.hamming = at("hamming").get<int>();
  if (at("decision_margin").is_number()) detection.decision_margin = at("decision_margin").get<double>();
  if (const json& sigma = at("corner_sigma_px"); sigma.is_number() && sigma.get<double>() > 0)
    detection.corner_covariance_px2 =
        CornerCovariance::Identity() * sigma.get<double>() * sigma.get<double>();
  if (at("corners") == to_string(CornerState::Unreliable)) detection.corner_state = CornerState::Unreliable;
  return detection;
}

/// A tag in a `tag_poses` line. Reports errors to `fields`.
SeenTagPose tag_pose_of(MessageFields& fields, const json& tag) {
  const TagId id = id_of(fields, tag);
  const std::vector<double> at = entries(tag, "position_m", 3);
  const std::vector<double> q = entries(tag, "rotation_xyzw", 4);
  const bool near =
      !at.empty() && std::ranges::all_of(at, [](double x) { return std::abs(x) < kMaxDistance_m; });
  if (!near) fields.wrong("tags", "'position_m' is not three numbers");
  Result<SO3> rotation = fail(ErrorCode::Unreadable, "'rotation_xyzw' is not four numbers");
  if (!q.empty()) rotation = SO3::try_from_quaternion(Eigen::Quaterniond(q[3], q[0], q[1], q[2]));
  if (!rotation) fields.wrong("tags", rotation.error().message);
  return near && rotation ? SeenTagPose{id, SE3(*rotation, Eigen::Vector3d(at[0], at[1], at[2]))}
                          : SeenTagPose{id, {}};
}

constexpr double kMaxCoordinate_m = 1e6;
constexpr double kMaxSpeed = 100;  // m/s and rad/s
constexpr double kMaxAngle_rad = 1e7;
constexpr std::int64_t kMaxPixels = 50'000'000;
/// Tag corners are at depth 5; the remaining levels are reserved for future keys.
constexpr std::size_t kMaxDepth = 16;

RobotHello hello_of(MessageFields& fields) {
  RobotHello hello;
  hello.protocol_version = fields.integer("protocol_version", 1, 1'000'000);
  if (hello.protocol_version > kRobotProtocol)
    fields.wrong("protocol_version",
                 fmt::format("{} is newer than this program's {}", hello.protocol_version, kRobotProtocol),
                 "Update waymark, or configure the robot to use the older version.");
  hello.name = fields.text("name");
  (void)fields.has("stamp_s");
  hello.lockstep = fields.flag_or_false("lockstep");
  hello.simulated_time = fields.flag_or_false("simulated_time");
  hello.simulated = fields.flag_or_false("simulated");
  if (fields.has("sends")) {
    const json* list = fields.array("sends", 100);
    for (const json& type : list != nullptr ? *list : json::array()) {
      if (type.is_string())
        hello.sends.push_back(type.get<std::string>());
      else
        fields.wrong("sends", "is not a list of strings");
    }
  }
  return hello;
}

RobotLog log_of(MessageFields& fields) {
  (void)fields.has("stamp_s");  // allowed, but not used
  return {fields.text("text")};
}

SE2 pose_of(MessageFields& fields) {
  const double x_m = fields.number("x_m", -kMaxCoordinate_m, kMaxCoordinate_m);
  const double y_m = fields.number("y_m", -kMaxCoordinate_m, kMaxCoordinate_m);
  return {SO2(fields.number("yaw_rad", -kMaxAngle_rad, kMaxAngle_rad)), Eigen::Vector2d(x_m, y_m)};
}

Sample odometry_of(MessageFields& fields) {
  Odometry odometry{.stamp = fields.stamp(), .odom_T_base = pose_of(fields)};
  odometry.speed_m_s = fields.number("speed_m_s", -kMaxSpeed, kMaxSpeed);
  odometry.yaw_rate_rad_s = fields.number("yaw_rate_rad_s", -kMaxSpeed, kMaxSpeed);
  return odometry;
}

Sample command_of(MessageFields& fields) {
  StampedCommand command{.stamp = fields.stamp()};
  command.command.speed_m_s = fields.number("speed_m_s", -kMaxSpeed, kMaxSpeed);
  command.command.yaw_rate_rad_s = fields.number("yaw_rate_rad_s", -kMaxSpeed, kMaxSpeed);
  return command;
}

Sample truth_of(MessageFields& fields) {
  const SensorTime stamp = fields.stamp();
  return TruthPose{stamp, lift(pose_of(fields))};
}

Sample wheels_of(MessageFields& fields) {
  const SensorTime stamp = fields.stamp();
  const double left_rad = fields.number("left_rad", -kMaxAngle_rad, kMaxAngle_rad);
  return WheelTicks{stamp, left_rad, fields.number("right_rad", -kMaxAngle_rad, kMaxAngle_rad)};
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
  scan.range_min_m = fields.number("range_min_m", 0, kMaxCoordinate_m);
  scan.range_max_m = fields.number("range_max_m", 0, kMaxCoordinate_m);
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
  Result<Image> image = fail(ErrorCode::Unreadable, "neither 'path' nor 'jpeg_base64' is given");
  const DecodeOptions limits{.max_pixels = kMaxPixels};
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
    fields.skip(to_string(image.error()));
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

void RobotMessageReader::warn_once(const std::string& warning) {
  // Identical warnings differ only in their line number.
  const std::string text = warning.substr(warning.find(':') == std::string::npos ? 0 : warning.find(':'));
  constexpr std::size_t kMaxWarnings = 50;
  if (warned_.size() < kMaxWarnings && warned_.insert(text).second) warnings_.push_back(warning);
}

/// Warns about the first skipped line, and again each time the number of skipped lines has doubled.
void RobotMessageReader::warn_skipped(std::int64_t line, const MessageFields& fields) {
  unsigned& count = fields.of_unknown_camera() ? unknown_cameras_ : unreadable_images_;
  ++count;
  if ((count & (count - 1)) != 0) return;
  const char* what = fields.of_unknown_camera() ? "line of an unknown camera" : "unreadable image";
  const char* plural = fields.of_unknown_camera() ? "lines of unknown cameras" : "unreadable images";
  warnings_.push_back(fmt::format("line {}: skipped {} {}; the last one: {}", line, count,
                                  count == 1 ? what : plural, fields.skip_reason()));
}

Result<std::optional<RobotMessage>> RobotMessageReader::read(const Line& line) {
  const Place place{.source = name_, .line = line.number};
  const auto bad = [&](std::string message, std::string hint = {}) {
    return fail(ErrorCode::Unreadable, std::move(message), place, std::move(hint));
  };
  if (line.too_long) return bad(fmt::format("is longer than {} bytes", kLongestLine));
  if (line.text.find_first_not_of(" \t\r") == std::string::npos) return std::optional<RobotMessage>();
  if (json_depth(line.text, kMaxDepth) > kMaxDepth)
    return bad(fmt::format("lists or objects are nested more than {} deep", kMaxDepth),
               "Messages of the protocol are at most 5 deep.");
  const json object = json::parse(line.text, nullptr, false);
  if (object.is_discarded() || !object.is_object())
    return bad(fmt::format("not a JSON object: '{}'", line.text.substr(0, 60)),
               line.text.find("NaN") != std::string::npos || line.text.find("Infinity") != std::string::npos
                   ? "JSON has neither NaN nor Infinity; the robot must omit a sample without a value."
                   : "Standard output is for protocol messages only; the robot must print other text to "
                     "standard error.");
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
               R"(The first line must be {"type":"hello","protocol_version":1,"name":"my robot"}.)");
  else if (name == "step")
    message = RobotStep{fields.integer("step", 1, std::int64_t{1} << 52U), fields.stamp()};
  else if (const auto found = sample_types().find(name); found != sample_types().end())
    message = found->second(fields);
  else
    warn_once(fmt::format("line {}: unknown line type '{}'; ignored", line.number, name));
  if (!message) return message;
  if (Status status = fields.finish(); !status) return tl::unexpected(status.error());
  if (!fields.skip_reason().empty()) {
    warn_skipped(line.number, fields);
    return std::optional<RobotMessage>();
  }
  greeted_ = greeted_ || name == "hello";
  return message;
}

RobotOrderLine parse_order_line(const std::string& text) {
  RobotOrderLine order;
  if (json_depth(text, kMaxDepth) > kMaxDepth) return order;
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

namespace {

using nlohmann::ordered_json;

ordered_json headed(const char* type, SensorTime stamp) {
  return {{"type", type}, {"stamp_ns", stamp.time_since_epoch().count()}};
}

void add_pose(ordered_json& line, const SE2& pose) {
  line["x_m"] = pose.x();
  line["y_m"] = pose.y();
  line["yaw_rad"] = pose.rotation().angle();
}

ordered_json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json of(const Odometry& odometry) {
  ordered_json line = headed("odometry", odometry.stamp);
  add_pose(line, odometry.odom_T_base);
  line["speed_m_s"] = odometry.speed_m_s;
  line["yaw_rate_rad_s"] = odometry.yaw_rate_rad_s;
  return line;
}

ordered_json of(const TruthPose& truth) {
  ordered_json line = headed("truth", truth.stamp);
  add_pose(line, project_to_plane(truth.map_T_base));
  return line;
}

ordered_json of(const WheelTicks& wheels) {
  ordered_json line = headed("wheels", wheels.stamp);
  line["left_rad"] = wheels.left_rad;
  line["right_rad"] = wheels.right_rad;
  return line;
}

ordered_json of(const ImuSample& imu) {
  ordered_json line = headed("imu", imu.stamp);
  line["angular_velocity_rad_s"] = vector(imu.angular_velocity_rad_s);
  line["linear_acceleration_m_s2"] = vector(imu.linear_acceleration_m_s2);
  return line;
}

ordered_json of(const LaserScan& scan) {
  ordered_json line = headed("scan", scan.stamp);
  line["angle_min_rad"] = scan.angle_min_rad;
  line["angle_increment_rad"] = scan.angle_increment_rad;
  line["time_increment_s"] = scan.time_increment_s;
  line["range_min_m"] = scan.range_min_m;
  line["range_max_m"] = scan.range_max_m;
  ordered_json ranges = ordered_json::array();
  for (const float range_m : scan.ranges_m)
    ranges.push_back(std::isfinite(range_m) ? ordered_json(range_m) : ordered_json());
  line["ranges_m"] = std::move(ranges);
  return line;
}

ordered_json of(const GamepadState& pad) {
  ordered_json line = headed("gamepad", pad.stamp);
  line["axes"] = pad.axes;
  line["buttons"] = pad.buttons;
  return line;
}

/// Adds the camera unless it has the default name used by robots with one camera.
void add_camera(ordered_json& line, const std::string& camera) {
  if (camera != "cam") line["camera"] = camera;
}

ordered_json of(const TagFrame& frame) {
  ordered_json line = headed("detections", frame.stamp);
  add_camera(line, frame.camera);
  ordered_json tags = ordered_json::array();
  for (const TagDetection& detection : frame.detections) {
    ordered_json corners = ordered_json::array();
    for (const Eigen::Vector2d& corner : detection.corners_px)
      corners.push_back(ordered_json{corner.x(), corner.y()});
    ordered_json tag = {{"tag", to_string(detection.tag)},
                        {"hamming", detection.hamming},
                        {"decision_margin", detection.decision_margin},
                        {"corners_px", std::move(corners)}};
    if (detection.corner_covariance_px2)
      tag["corner_sigma_px"] = std::sqrt(detection.corner_covariance_px2->trace() / 8);
    if (!usable_corners(detection)) tag["corners"] = to_string(detection.corner_state);
    tags.push_back(std::move(tag));
  }
  line["tags"] = std::move(tags);
  return line;
}

ordered_json of(const TagPoseFrame& frame) {
  ordered_json line = headed("tag_poses", frame.stamp);
  add_camera(line, frame.camera);
  ordered_json tags = ordered_json::array();
  for (const SeenTagPose& seen : frame.tags) {
    const Eigen::Quaterniond q = seen.cam_T_tag.rotation().quaternion();
    tags.push_back({{"tag", to_string(seen.tag)},
                    {"position_m", vector(seen.cam_T_tag.translation())},
                    {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}});
  }
  line["tags"] = std::move(tags);
  return line;
}

ordered_json of(const RobotHello& hello) {
  ordered_json line = {{"type", "hello"},
                       {"protocol_version", hello.protocol_version},
                       {"name", hello.name},
                       {"sends", hello.sends},
                       {"lockstep", hello.lockstep}};
  if (hello.simulated_time) line["simulated_time"] = true;
  if (hello.simulated) line["simulated"] = true;
  return line;
}

ordered_json of(const RobotStep& step) {
  ordered_json line = headed("step", step.stamp);
  line["step"] = step.step;
  return line;
}

ordered_json of(const RobotLog& log) { return {{"type", "log"}, {"text", log.text}}; }

template <class Anything>
ordered_json of(const Anything& /*has no line*/) {
  return {};
}

}  // namespace

std::string to_line(const RobotMessage& message, const std::vector<std::uint8_t>& image) {
  ordered_json line;
  if (const auto* sample = std::get_if<Sample>(&message)) {
    line = std::visit([](const auto& value) { return of(value); }, *sample);
    if (const auto* frame = std::get_if<CameraFrame>(sample)) {
      line = headed("image", frame->stamp);
      add_camera(line, frame->camera);
      line["jpeg_base64"] = encode_base64(image);
    }
  } else {
    line = std::visit([](const auto& value) { return of(value); }, message);
  }
  if (line.is_null() || line.empty()) return {};
  // Messages may quote bytes received over a network that are not valid UTF-8.
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace waymark
