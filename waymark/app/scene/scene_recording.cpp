#include "waymark/app/scene/scene_recording.hpp"

#include <algorithm>
#include <charconv>
#include <memory>
#include <numbers>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/sample_decoder.hpp"

namespace waymark {
namespace {

bool contains_tags(const LogChannel& channel) {
  std::string type = channel.type;
  return type == ros2::ApriltagArrayStamped::kType || type == ros2::AprilTagDetectionArray::kType;
}

/// Removes the leading slash, which is ignored when topics are compared.
std::string_view without_slash(std::string_view topic) {
  return topic.starts_with('/') ? topic.substr(1) : topic;
}

Result<std::map<std::string, std::size_t>> cameras_by_topic(const MessageLog& log, const TagScene& scene) {
  std::vector<std::string> topics;
  for (const LogChannel& channel : log.channels()) {
    if (contains_tags(channel)) topics.push_back(channel.topic);
  }
  std::map<std::string, std::size_t> cameras;
  for (std::size_t c = 0; c < scene.cameras.size(); ++c) {
    const std::string& wanted = scene.cameras[c].topic;
    const auto it = std::ranges::find_if(
        topics, [&](const std::string& topic) { return without_slash(topic) == without_slash(wanted); });
    if (it != topics.end()) {
      cameras[*it] = c;
    } else if (scene.cameras.size() == 1 && topics.size() == 1) {
      cameras[topics.front()] = c;
    } else {
      return fail(ErrorCode::NotFound,
                  fmt::format("no detections of {} on topic '{}'", scene.cameras[c].name, wanted), {},
                  topics.empty() ? "No topic of this recording contains tags with corners."
                                 : fmt::format("Topics with tags: {}.", fmt::join(topics, ", ")));
    }
  }
  return cameras;
}

class Reader {
 public:
  explicit Reader(const TagScene& scene) : scene_(scene) {
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
      if (!scene.bodies[b].odometry_frame.empty()) bodies_[scene.bodies[b].odometry_frame] = b;
    }
  }

  /// Adds the detections from a camera.
  Status tags(std::size_t camera, const LogChannel& channel, std::uint64_t log_time, ByteSpan cdr) {
    SampleDecoder decoder([&](const Sample& sample) -> Status {
      const auto* frame = std::get_if<TagFrame>(&sample);
      if (frame != nullptr) views_.push_back({frame->stamp, {camera, frame->detections}});
      return {};
    });
    Status status = decoder.add(channel.topic, channel.type, log_time, cdr);
    return status ? decoder.finish() : status;
  }

  Status odometry(ByteSpan cdr) {
    const auto message = cdr::decode<ros2::Odometry>(cdr);
    if (!message) return tl::unexpected(message.error());
    const auto it = bodies_.find(message->child_frame_id);
    if (it == bodies_.end()) return {};
    const ros2::Pose& pose = message->pose.pose;
    const Eigen::Vector4d q(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w);
    if (!(q.norm() > 0.5 && q.norm() < 2))
      return fail(ErrorCode::Unreadable, "invalid quaternion in odometry");
    odometry_.push_back({ros2::from_ros(message->header.stamp), it->second, ros2::from_ros(pose)});
    return {};
  }

  [[nodiscard]] bool wants_odometry() const { return !bodies_.empty(); }

  SceneRecording finish() {
    std::ranges::stable_sort(odometry_, {}, &SceneOdometry::stamp);
    return {group_views(std::move(views_), scene_.approximate_sync), std::move(odometry_)};
  }

 private:
  const TagScene& scene_;
  std::map<std::string, std::size_t> bodies_;
  std::vector<std::pair<SensorTime, SceneView>> views_;
  std::vector<SceneOdometry> odometry_;
};

}  // namespace

Result<SceneRecording> read_scene_recording(const std::filesystem::path& path, const TagScene& scene,
                                            const JobControl& control, std::vector<std::string>& problems) {
  const auto log = open_recording(path, control);
  if (!log) return tl::unexpected(log.error());
  if ((*log)->format() == LogFormat::Csv)
    return fail(ErrorCode::InvalidArgument, "a CSV table has no camera name and stamp per detection",
                {.source = path.string()}, "Use a bag or an MCAP file with detections for `tagslam`.");
  const auto cameras = cameras_by_topic(**log, scene);
  if (!cameras) {
    Error error = cameras.error();
    error.place.source = path.string();
    return tl::unexpected(error);
  }
  Reader reader(scene);
  LogSelection selection;
  for (const auto& [topic, camera] : *cameras) selection.topics.insert(topic);
  for (const LogChannel& channel : (*log)->channels()) {
    if (channel.type == ros2::Odometry::kType && reader.wants_odometry())
      selection.topics.insert(channel.topic);
  }
  const auto note = [&](LogProblem::Kind /*kind*/, const std::string& /*key*/, const Error& error) {
    problems.push_back(to_string(error));
  };
  CdrChannels channels(note);
  const Status status =
      (*log)->visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
        const auto cdr = channels.convert(channel, message);
        if (!cdr || !cdr->channel->known_layout) return {};
        const auto camera = cameras->find(channel.topic);
        Status read = camera != cameras->end()
                          ? reader.tags(camera->second, cdr->channel->channel, message.log_time, cdr->data)
                          : reader.odometry(cdr->data);
        if (!read) problems.push_back(to_string(read.error()));
        return {};
      });
  if (!status) return tl::unexpected(status.error());
  for (const LogProblem& problem : (*log)->problems()) problems.push_back(to_string(problem.error));
  SceneRecording recording = reader.finish();
  if (recording.frames.empty())
    return fail(ErrorCode::NotFound, "the recording contains no frame of these cameras",
                {.source = path.string()});
  return recording;
}

namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 27U;

/// Reads the file or, if it does not exist, a compressed version (.gz, .bz2, .zst).
Result<std::string> read_maybe_compressed(const std::filesystem::path& path) {
  std::error_code ignored;
  std::filesystem::path found = path;
  for (const char* suffix : {"", ".gz", ".bz2", ".zst"}) {
    if (std::filesystem::exists(path.string() + suffix, ignored)) {
      found = path.string() + suffix;
      break;
    }
  }
  Result<std::string> text = read_file(found, kMaxBytes);
  if (!text) return text;
  const Packing packing = packing_of(as_bytes(*text));
  if (packing == Packing::None) return text;
  const UnpackedBytes unpacked = unpack_bytes(packing, as_bytes(*text), kMaxBytes);
  if (!unpacked.damage) return std::string(as_text(unpacked.bytes));
  Error error = *unpacked.damage;
  error.place.source = found.string();
  return tl::unexpected(error);
}

/// Calls visit() with the cells of each row after the header. visit() returns false if the pose is invalid.
Status for_rows(const std::filesystem::path& path, std::size_t columns,
                const std::function<bool(const std::vector<std::string>&)>& visit) {
  const auto text = read_maybe_compressed(path);
  if (!text) return tl::unexpected(text.error());
  std::istringstream lines(*text);
  std::string line;
  for (std::int64_t number = 1; std::getline(lines, line); ++number) {
    if (number == 1 || line.empty()) continue;
    std::vector<std::string> row;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    const auto invalid = [&](const std::string& why) {
      return fail(ErrorCode::Unreadable, why, {.source = path.string(), .line = number},
                  "See docs/formats/tagslam.md.");
    };
    if (row.size() < columns) return invalid(fmt::format("{} columns instead of {}", row.size(), columns));
    if (!visit(row)) return invalid("columns 3 to 9 are not a position and a unit quaternion");
  }
  return {};
}

std::optional<SE3> pose_of(const std::vector<std::string>& row, std::size_t first) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const std::string& text = row[first + i];
    if (std::from_chars(text.data(), text.data() + text.size(), v[i]).ec != std::errc{}) return std::nullopt;
  }
  const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  if (!(q.norm() > 0.9 && q.norm() < 1.1)) return std::nullopt;
  return SE3(SO3::from_matrix(q.normalized().toRotationMatrix()), Eigen::Vector3d(v[0], v[1], v[2]));
}

}  // namespace

Result<SceneValues> read_scene_values(const std::filesystem::path& folder, const TagScene& scene) {
  SceneValues values;
  const SE3 half_turn(SO3::exp(Eigen::Vector3d(std::numbers::pi, 0, 0)), Eigen::Vector3d::Zero());
  Status status = for_rows(folder / "ref_static.csv", 9, [&](const std::vector<std::string>& row) {
    const auto pose = pose_of(row, 2);
    const std::string& child = row[1];
    if (!pose) return false;
    if (child.starts_with("tag_"))
      values.tags[std::atoi(child.c_str() + 4)] = *pose * half_turn;
    else if (row[0] == "map")
      values.static_bodies[child] = *pose;
    else if (std::ranges::any_of(scene.cameras, [&](const CameraOnBody& c) { return c.name == child; }))
      values.cameras[child] = *pose;
    return true;
  });
  if (!status) return tl::unexpected(status.error());
  status = for_rows(folder / "ref_trajectory.csv", 9, [&](const std::vector<std::string>& row) {
    const auto pose = pose_of(row, 2);
    if (pose) values.moving_bodies[{row[1], std::atoll(row[0].c_str())}] = *pose;
    return pose.has_value();
  });
  if (!status) return tl::unexpected(status.error());
  return values;
}

}  // namespace waymark
