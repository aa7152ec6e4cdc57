#include "waymark/app/localize/localize_output.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>
#include <variant>

#include "waymark/app/common/estimate_message.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

constexpr const char* kYaml = "application/yaml";

std::string extension_of(const std::string& path) { return std::filesystem::path(path).extension().string(); }

/// Whether the output is a text file that contains only poses.
bool writes_tum(const std::string& path) {
  return extension_of(path) == ".txt" || extension_of(path) == ".tum";
}

Result<SampleRecorder> open_recording(const std::string& path, const LocalizerSetup& setup,
                                      const LocalizeSource& source) {
  auto file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  Result<SampleRecorder> recorder =
      SampleRecorder::open(std::move(*file), {.library = "waymark " WAYMARK_VERSION});
  if (!recorder) return tl::unexpected(recorder.error());
  Status status = recorder->add_metadata(lap_facts::kMetadata,
                                         {{"verb", "localize"},
                                          {"version", WAYMARK_VERSION},
                                          {"method", std::string(to_string(setup.method))},
                                          {"source", source.name},
                                          {"map", std::filesystem::path(source.map).filename().string()}});
  if (status)
    status = recorder->add_attachment("options.yaml", kYaml, {}, "filter:\n" + write_fields(setup.filter, 2));
  if (status && !source.robot_yaml.empty())
    status = recorder->add_attachment(lap_facts::kRobotFile, kYaml, {}, source.robot_yaml);
  if (!status) return tl::unexpected(status.error());
  if (source.live) recorder->add_cameras_with_first_sample(source.cameras);
  return recorder;
}

}  // namespace

Status check_localize_output(const std::string& output) {
  std::error_code ignored;
  if (writes_tum(output) && std::filesystem::is_regular_file(output, ignored))
    return fail(ErrorCode::Unwritable, "the file already exists and is not overwritten", {.source = output},
                "Choose another name, or remove the file.");
  if (writes_tum(output)) return check_output_file(output);
  if (output.empty() || extension_of(output) == ".mcap") return {};
  return fail(ErrorCode::InvalidArgument, "unknown file extension of the output",
              {.source = output, .key = "`output`"},
              "Use .mcap (recording of poses with covariances, observations and odometry), or .txt or .tum "
              "(one pose per line).");
}

Status check_recorded_images(const std::string& images, const std::string& output) {
  if (images.empty() || !output.empty()) return {};
  return fail(ErrorCode::InvalidArgument, "cannot record images without a recording",
              {.key = "record_images"}, "Add `output=FILE.mcap`.");
}

Result<LocalizeOutput> LocalizeOutput::open(const std::string& path, const LocalizerSetup& setup,
                                            const LocalizeSource& source) {
  if (Status status = check_localize_output(path); !status) return tl::unexpected(status.error());
  LocalizeOutput output(writes_tum(path) ? path : std::string(), source);
  if (path.empty() || writes_tum(path)) return output;
  Result<SampleRecorder> recorder = open_recording(path, setup, source);
  if (!recorder) return tl::unexpected(recorder.error());
  output.recorder_.emplace(std::move(*recorder));
  return output;
}

Status LocalizeOutput::on_sample(const Sample& sample) {
  newest_ = stamp_of(sample);
  if (!first_) first_ = newest_;
  if (!recorder_) return {};
  const auto* image = std::get_if<CameraFrame>(&sample);
  if (image != nullptr) return source_.live ? record_image(*image, source_.images, *recorder_) : Status();
  const bool kept =
      source_.live || std::holds_alternative<Odometry>(sample) || std::holds_alternative<TruthPose>(sample);
  return kept ? recorder_->add(sample) : Status();
}

Status LocalizeOutput::on_estimate(const LocalizationEstimate& estimate) {
  if (last_ && estimate.stamp <= *last_) return {};
  last_ = estimate.stamp;
  ++report_.estimates;
  report_.last = estimate;
  if (estimate.certain) {
    ++report_.certain;
    if (!report_.first_fix_s)
      report_.first_fix_s = to_seconds(estimate.stamp - first_.value_or(estimate.stamp));
    if (!poses_file_.empty()) trajectory_.push_back({estimate.stamp, lift(estimate.map_T_base)});
  }
  if (!recorder_) return {};
  return recorder_->add_message(estimate.certain ? topics::kEstimate : kUncertainTopic, estimate.stamp,
                                estimate_message(estimate));
}

Status LocalizeOutput::on_comparison(const NisRecord& record) {
  ++report_.compared;
  report_.accepted += record.accepted ? 1 : 0;
  if (record.accepted) nis_sum_ += record.nis / record.rows;
  return recorder_ ? recorder_->add_message(kNisTopic, record.stamp, nis_message(record)) : Status();
}

Status LocalizeOutput::on_pose(SensorTime stamp, const ros2::PoseWithCovarianceStamped& pose) {
  if (!poses_file_.empty()) trajectory_.push_back({stamp, ros2::from_ros(pose.pose.pose)});
  return recorder_ ? recorder_->add_message(topics::kEstimate, stamp, pose) : Status();
}

Result<LocalizeReport> LocalizeOutput::close(bool failed) {
  if (report_.accepted > 0) report_.nis_mean = nis_sum_ / static_cast<double>(report_.accepted);
  if (first_) report_.duration_s = to_seconds(newest_ - *first_);
  Status status = recorder_ ? recorder_->close() : Status();
  if (status && !failed && !poses_file_.empty()) status = write_text_file(poses_file_, to_tum(trajectory_));
  if (!status) return tl::unexpected(status.error());
  return report_;
}

}  // namespace waymark
