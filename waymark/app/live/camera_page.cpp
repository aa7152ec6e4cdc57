#include "waymark/app/live/camera_page.hpp"

#include <chrono>
#include <ctime>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

using nlohmann::ordered_json;
using std::chrono::milliseconds;

constexpr Duration kTextPeriod = milliseconds(200);
constexpr Duration kControlsPeriod = std::chrono::seconds(2);  // reading the controls takes a USB transfer
                                                               // each
constexpr double kSmoothing = 0.1;
constexpr const char* kText = "camera.json";

/// Returns a name such as "snapshot-20261123-183201.125".
std::string name_at(const char* what, SensorTime stamp) {
  const auto ms = std::chrono::floor<milliseconds>(stamp.time_since_epoch()).count();
  const std::time_t seconds = ms / 1000;
  std::tm local{};
  localtime_r(&seconds, &local);
  return fmt::format("{}-{:%Y%m%d-%H%M%S}.{:03}", what, local, ms % 1000);
}

}  // namespace

CameraPage::CameraPage(LiveCamera& camera, LiveFeed& feed, const std::optional<PoseSetup>& poses)
    : camera_(camera), feed_(feed), poses_(poses) {
  if (poses) feed_.show_camera(poses->camera, base_T_camera({}));
  if (poses && poses->sizes.default_size_m)
    feed_.show_text("tags.yaml", fmt::format("tag_size_m: {}\n", *poses->sizes.default_size_m));
  feed_.show_text(kText, json_line(ordered_json{{"camera", camera.description()}}));
}

void CameraPage::show(const CameraImage& seen, const PoseList& poses) {
  // Lets the page show the time since exposure rather than since detection.
  const std::int64_t now_ns = seen.frame.stamp.time_since_epoch().count();
  feed_.publish(seen.frame, now_ns);
  feed_.publish(TagFrame{seen.frame.stamp, seen.frame.camera, seen.found.detections}, now_ns);
  for (const ViewerOrder& order : feed_.take_orders()) obey(order, seen);
  if (recorder_)
    if (const Status recorded = record(seen); !recorded) {
      recorder_.reset();
      show_message(to_string(recorded.error()));
    }
  count(seen.frame.stamp);
  publish_text(seen, poses);
}

void CameraPage::show_message(const std::string& words) { words_ = words; }

void CameraPage::guide(ordered_json status, bool at_once) {
  guide_ = std::move(status);
  if (at_once) text_sent_ = {};
}

void CameraPage::count(SensorTime stamp) {
  if (last_) {
    const double period_s = to_seconds(stamp - *last_);
    period_s_ = period_s_ == 0 ? period_s : (1 - kSmoothing) * period_s_ + kSmoothing * period_s;
  }
  last_ = stamp;
}

void CameraPage::obey(const ViewerOrder& order, const CameraImage& seen) {
  switch (order.kind) {
    case ViewerOrder::Kind::Snapshot:
      return take_snapshot(seen);
    case ViewerOrder::Kind::Record:
      return start_or_end_recording(seen);
    case ViewerOrder::Kind::SetControl: {
      const Status set = camera_.set_control(order.control, order.value);
      show_message(set ? fmt::format("{} set to {:g}", order.control, order.value) : to_string(set.error()));
      controls_read_ = {};
      return;
    }
    default:
      return;  // ignores orders that are meant for robots
  }
}

void CameraPage::take_snapshot(const CameraImage& seen) {
  const std::string name = name_at("snapshot", seen.frame.stamp) + ".png";
  const Status written = write_image(name, seen.frame.image);
  show_message(written ? "saved " + name : to_string(written.error()));
}

void CameraPage::start_or_end_recording(const CameraImage& seen) {
  if (recorder_) {
    const auto closed = close();
    return show_message(closed ? "recorded " + *closed : to_string(closed.error()));
  }
  const Status begun = begin_recording(seen);
  if (!begun) recorder_.reset();
  show_message(begun ? "recording " + recording_ : to_string(begun.error()));
}

Status CameraPage::begin_recording(const CameraImage& seen) {
  recording_ = name_at("camera", seen.frame.stamp) + ".mcap";
  auto file = create_file(recording_);
  if (!file) return tl::unexpected(file.error());
  auto recorder = SampleRecorder::open(std::move(*file), {.library = "waymark " WAYMARK_VERSION});
  if (!recorder) return tl::unexpected(recorder.error());
  recorder_ = std::move(*recorder);
  std::map<std::string, std::string> facts = {
      {"verb", "detect"}, {"version", WAYMARK_VERSION}, {"source", camera_.description()}};
  if (poses_) add_tag_sizes(poses_->sizes, facts);
  if (poses_)
    recorder_->add_cameras_with_first_sample({{.camera = poses_->camera, .base_T_cam = base_T_camera({})}});
  return recorder_->add_metadata(lap_facts::kMetadata, facts);
}

Status CameraPage::record(const CameraImage& seen) {
  if (Status added = record_image(seen.frame, "jpeg", *recorder_); !added) return added;
  return recorder_->add(TagFrame{seen.frame.stamp, seen.frame.camera, seen.found.detections});
}

Result<std::string> CameraPage::close() {
  if (!recorder_) return std::string();
  const Status closed = recorder_->close();
  recorder_.reset();
  if (!closed) return tl::unexpected(closed.error());
  return recording_;
}

void CameraPage::publish_text(const CameraImage& seen, const PoseList& poses) {
  if (seen.frame.stamp - text_sent_ < kTextPeriod) return;
  text_sent_ = seen.frame.stamp;
  if (seen.frame.stamp - controls_read_ >= kControlsPeriod) {
    controls_read_ = seen.frame.stamp;
    controls_ = ordered_json::array();
    for (const CameraControl& control : camera_.controls()) controls_.push_back(to_json(fields(control)));
  }
  ordered_json tags = ordered_json::array();
  for (std::size_t i = 0; i < seen.found.detections.size(); ++i) {
    ordered_json tag{{"tag", to_string(seen.found.detections[i].tag)}};
    if (i < poses.size()) tag.update(to_json(pose_fields(poses[i])));
    tags.push_back(std::move(tag));
  }
  const CameraCounts counts = camera_.counts();
  ordered_json text{{"camera", camera_.description()},
                    {"rate_hz", period_s_ > 0 ? 1 / period_s_ : 0},
                    {"age_ms", 1e3 * to_seconds(seen.age)},
                    {"dropped", counts.dropped},
                    {"lost", counts.lost},
                    {"damaged", counts.damaged},
                    {"recording", recorder_ ? recording_ : std::string()},
                    {"message", words_},
                    {"tags", std::move(tags)},
                    {"controls", controls_}};
  if (!guide_.is_null()) text["guide"] = guide_;
  feed_.show_text(kText, json_line(text));
}

}  // namespace waymark
