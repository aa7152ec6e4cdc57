#include "waymark/app/detect/detect_images.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/detect/annotated_images.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/plot/annotate.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Where annotated images are written.
struct Annotations {
  fs::path folder;                      ///< empty if none are written to a folder
  std::optional<AnnotatedVideo> video;  ///< used instead of a folder
  std::vector<std::string> names;
  bool failed = false;  ///< whether creating the folder failed
};

/// Creates the folder, or prepares the video. Fails if the folder contains input images, because they could
/// be overwritten by annotated ones.
Result<Annotations> prepare_annotations(const std::string& folder, const std::vector<Input>& inputs,
                                        const JobControl& control) {
  Annotations annotations;
  if (folder.empty()) return annotations;
  if (is_video_name(folder)) {
    Result<AnnotatedVideo> video = AnnotatedVideo::create(folder, inputs);
    if (!video) return tl::unexpected(video.error());
    annotations.video = std::move(*video);
    return annotations;
  }
  std::vector<std::string> paths;
  for (const Input& input : inputs) {
    paths.push_back(input.path);
    const fs::path parent = fs::path(input.path).parent_path();
    std::error_code ignored;
    if (!input.error && fs::equivalent(parent.empty() ? "." : parent, folder, ignored)) {
      return fail(
          ErrorCode::InvalidArgument, "this folder contains the input images", {.key = folder},
          "Set `annotate` to another folder, for example " + (fs::path(folder) / "annotated").string() + ".");
    }
  }
  annotations.names = annotation_names(paths);
  std::error_code error;
  fs::create_directories(folder, error);
  annotations.failed = error || !fs::is_directory(folder, error);
  if (!annotations.failed) annotations.folder = folder;
  if (annotations.failed) {
    const std::string reason = error ? error.message() : "it is not a folder";
    control.note(to_string(Error{ErrorCode::Unwritable,
                                 "cannot create the folder for annotated images: " + reason,
                                 {.source = folder},
                                 "Tags are reported, but no annotated images are written."}));
  }
  return annotations;
}

/// `name` for an image file. For an image in a recording, the timestamp is added: "lap_12.345000000.png".
std::string annotation_name(const std::string& name, const ImageReport& report, const Input& input) {
  if (report.image == input.path) return name;
  const std::size_t stamp = report.image.rfind('#');
  return fmt::format("{}_{}.png", fs::path(name).stem().string(), report.image.substr(stamp + 1));
}

/// An existing file with other content is renamed to a backup.
Status write_in_folder(const fs::path& path, const ColorImage& image) {
  const auto bytes = encode_png(image);
  if (!bytes) return tl::unexpected(bytes.error());
  const std::string content(bytes->begin(), bytes->end());
  if (const auto backup = move_aside(path, content); !backup) return tl::unexpected(backup.error());
  return write_bytes(path, *bytes);
}

Status write_annotated(Annotations& annotations, const std::string& name, const Input& input,
                       const ImageReport& report, const ImageView& image,
                       const std::vector<plot::FrameAxes>& axes) {
  const auto drawn = plot::annotate(image, report.detections, axes);
  if (!drawn) return tl::unexpected(drawn.error());
  if (annotations.video) return annotations.video->add(*drawn, report.stamp);
  return write_in_folder(annotations.folder / annotation_name(name, report, input), *drawn);
}

/// Passes reports on. Until a tag is found, each report is kept until the next one arrives, because the last
/// report of a run without tags contains the cause.
class ReportQueue {
 public:
  explicit ReportQueue(const EachDetected& each) : each_(each) {}

  /// Returns whether to continue.
  bool add(const ImageReport& report, PoseList poses) {
    found_ = found_ || !report.detections.empty() || report.beyond_lens > 0;
    send_kept();
    if (found_)
      going_ = going_ && each_(report, poses);
    else if (going_)
      kept_ = Kept{report, std::move(poses)};
    return going_;
  }
  [[nodiscard]] bool going() const { return going_; }
  void end(std::optional<NoTagReason> reason) {
    if (kept_) kept_->report.no_tag_reason = std::move(reason);
    send_kept();
  }

 private:
  struct Kept {
    ImageReport report{};
    PoseList poses{};
  };

  void send_kept() {
    if (kept_) going_ = each_(kept_->report, kept_->poses);
    kept_.reset();
  }

  const EachDetected& each_;
  std::optional<Kept> kept_{};
  bool found_ = false;
  bool going_ = true;
};

}  // namespace

PoseList poses_for(ImageReport& report, const PoseSetup& setup) {
  if (report.width_px == 0) return {};
  if (const Status fits = check_image_size(setup.camera, report.width_px, report.height_px); !fits) {
    if (!report.error) report.error = fits.error();
    return {};
  }
  return poses_of(report.detections, setup);
}

Result<DetectSummary> detect_images(const DetectJob& job, const TagFinder& finder, const JobControl& control,
                                    const EachDetected& each) {
  const std::vector<Input> inputs = find_inputs(job.sources, job.recursive);
  auto annotations = prepare_annotations(job.annotate_folder, inputs, control);
  if (!annotations) return tl::unexpected(annotations.error());
  ReportQueue reports(each);
  const auto on_image = [&](std::size_t i, ImageReport& report, const ImageView& image) {
    PoseList poses = job.poses ? poses_for(report, *job.poses) : PoseList();
    const bool annotate = annotations->video || !annotations->folder.empty();
    if (annotate && report.detected) {
      const auto axes =
          job.poses ? axes_of(report.detections, poses, *job.poses) : std::vector<plot::FrameAxes>();
      const std::string name = annotations->video ? std::string() : annotations->names[i];
      const Status written = write_annotated(*annotations, name, inputs[i], report, image, axes);
      if (!written && !report.error) report.error = written.error();
    }
    return reports.add(report, std::move(poses));
  };
  const LensChoice lens{.camera = job.poses ? ImageLens::of(job.poses->camera) : ImageLens::unknown(),
                        .use_recorded = true};
  DetectSummary summary = detect_all(inputs, finder, lens, control, on_image);
  const auto reason = reports.going() ? no_tag_reason(summary, finder) : std::nullopt;
  if (reason) control.note("note: " + reason->message);
  reports.end(reason);
  summary.annotations_failed = annotations->failed;
  const Status closed = annotations->video ? annotations->video->close() : Status();
  if (!closed) {
    control.note(to_string(closed.error()));
    summary.annotations_failed = true;
  }
  return summary;
}

namespace {

/// Root mean square of the standard deviations of the corner coordinates. `nullopt` without a covariance.
std::optional<double> sigma_px(const TagDetection& detection) {
  if (!detection.corner_covariance_px2) return std::nullopt;
  return std::sqrt(std::max(0.0, detection.corner_covariance_px2->trace() / 8));
}

/// Angle between the line of sight and the tag's normal.
double incidence_deg(const SE3& cam_T_tag) {
  const Eigen::Vector3d normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  return to_degrees(std::acos(std::clamp(normal.dot(cam_T_tag.translation().normalized()), -1.0, 1.0)));
}

/// Decimals that show two significant digits of a standard deviation.
int decimals_for(double sigma, int max_decimals) {
  if (!(sigma > 0)) return max_decimals;
  return std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, max_decimals);
}

std::string rounded_sigma(double sigma) {
  constexpr int kMaxDecimals = 4;
  return fmt::format("{:.{}f}", sigma, decimals_for(sigma, kMaxDecimals));
}

std::string row(const std::string& name, const TagPoseSolution& solution) {
  constexpr int kMaxDecimals = 5;  // 10 micrometres
  const PoseDeviations sigma = standard_deviations(solution.cam_T_tag, solution.covariance);
  const Eigen::Vector3d& t = solution.cam_T_tag.translation();
  std::string text = fmt::format("  {:<22}", name);
  for (const int axis : {0, 1, 2})
    text += fmt::format("{:>9.{}f}", t[axis], decimals_for(sigma.position_m[axis], kMaxDecimals));
  for (const int axis : {0, 1, 2}) text += fmt::format("{:>9}", rounded_sigma(1e3 * sigma.position_m[axis]));
  return text + fmt::format("{:>9}{:>8.1f}{:>8.3f}\n",
                            rounded_sigma(to_degrees(sigma.rotation_rad.maxCoeff())),
                            incidence_deg(solution.cam_T_tag), solution.rms_px);
}

}  // namespace

std::string to_text(const ImageReport& report) {
  std::string text = fmt::format("{}: {} in {} x {} px\n", report.image,
                                 counted(report.detections.size(), "tag"), report.width_px, report.height_px);
  if (report.detections.empty()) return text;
  text += fmt::format("  {:<22}{:>10}{:>10}{:>9}{:>9}{:>8}{:>8}\n", "tag", "centre x", "centre y", "side px",
                      "sigma px", "margin", "hamming");
  for (std::size_t i = 0; i < report.detections.size(); ++i) {
    const TagDetection& tag = report.detections[i];
    const Eigen::Vector2d center = center_px(tag.corners_px);
    const auto sigma = sigma_px(tag);
    const bool refined =
        i >= report.refinements.size() || report.refinements[i] == RefinementOutcome::Refined;
    text += fmt::format(
        "  {:<22}{:>10.2f}{:>10.2f}{:>9.1f}{:>9}{:>8.1f}{:>8}{}\n", to_string(tag.tag), center.x(),
        center.y(), mean_side_px(tag.corners_px), sigma ? fmt::format("{:.3f}", *sigma) : "-",
        tag.decision_margin, tag.hamming,
        refined ? ""
                : fmt::format("   corners {}: {}", usable_corners(tag) ? "not refined" : "unreliable",
                              to_string(report.refinements[i])));
  }
  return text;
}

std::string to_text(std::span<const TagDetection> detections, const PoseList& poses) {
  if (poses.empty()) return {};
  std::string text =
      fmt::format("  {:<22}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "pose in camera frame", "x m",
                  "y m", "z m", "±x mm", "±y mm", "±z mm", "±rot °", "tilt °", "rms px");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = to_string(detections[i].tag);
    if (!poses[i]) {
      text += fmt::format("  {:<22}{}\n", name, to_string(poses[i].error()));
      continue;
    }
    text += row(name, poses[i]->best);
    if (poses[i]->other)
      text += row(fmt::format("  or (ratio {:.2f})", poses[i]->ambiguity_ratio()), *poses[i]->other);
  }
  return text;
}

}  // namespace waymark
