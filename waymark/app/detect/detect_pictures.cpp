#include "waymark/app/detect/detect_pictures.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/detect/annotated_video.hpp"
#include "waymark/app/detect/annotation_names.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/plot/annotate.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// Where annotated pictures go, once that is known to work.
struct Annotations {
  fs::path folder;                      ///< empty when there is none
  std::optional<AnnotatedVideo> video;  ///< instead of a folder
  std::vector<std::string> names;
  bool failed = false;  ///< wanted, but the folder cannot be made
};

/// Makes the folder, or begins the video. Refuses a folder that holds pictures to be read: annotations must
/// not overwrite what they were made from.
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
          ErrorCode::InvalidArgument, "this folder holds the pictures themselves", {.source = folder},
          "Give --annotate another folder, for example " + (fs::path(folder) / "annotated").string() + ".");
    }
  }
  annotations.names = annotation_names(paths);
  std::error_code error;
  fs::create_directories(folder, error);
  annotations.failed = error || !fs::is_directory(folder, error);
  if (!annotations.failed) annotations.folder = folder;
  if (annotations.failed) {
    const std::string why = error ? error.message() : "is not a folder";
    control.note(to_string(Error{ErrorCode::Unwritable,
                                 "cannot make the folder for annotated pictures: " + why,
                                 {.source = folder},
                                 "Tags are reported, but no pictures written."}));
  }
  return annotations;
}

/// The name of a picture's own; of a recording's, its stamp behind that of the file: "lap_12.345000000.png".
std::string annotation_name(const std::string& name, const PictureReport& report, const Input& input) {
  if (report.image == input.path) return name;
  const std::size_t stamp = report.image.rfind('#');
  return fmt::format("{}_{}.png", fs::path(name).stem().string(), report.image.substr(stamp + 1));
}

Status write_annotated(Annotations& annotations, const std::string& name, const Input& input,
                       const PictureReport& report, const ImageView& image,
                       const std::vector<plot::FrameAxes>& axes) {
  const auto drawn = plot::annotate(image, report.detections, axes);
  if (!drawn) return tl::unexpected(drawn.error());
  if (annotations.video) return annotations.video->add(*drawn, report.stamp);
  return write_image(annotations.folder / annotation_name(name, report, input), *drawn);
}

}  // namespace

PoseList poses_for(PictureReport& report, const PoseSetup& setup) {
  if (report.width_px == 0) return {};
  if (const Status fits = check_picture_size(setup.camera, report.width_px, report.height_px); !fits) {
    if (!report.error) report.error = fits.error();
    return {};
  }
  return poses_of(report.detections, setup);
}

Result<DetectSummary> detect_pictures(const DetectJob& job, const TagFinder& finder,
                                      const JobControl& control, const EachDetected& each) {
  const std::vector<Input> inputs = find_inputs(job.sources, job.recursive);
  auto annotations = prepare_annotations(job.annotate_folder, inputs, control);
  if (!annotations) return tl::unexpected(annotations.error());
  const auto on_picture = [&](std::size_t i, PictureReport& report, const ImageView& image) {
    const PoseList poses = job.poses ? poses_for(report, *job.poses) : PoseList();
    const bool annotate = annotations->video || !annotations->folder.empty();
    if (annotate && report.detected) {
      const auto axes =
          job.poses ? axes_of(report.detections, poses, *job.poses) : std::vector<plot::FrameAxes>();
      const std::string name = annotations->video ? std::string() : annotations->names[i];
      const Status written = write_annotated(*annotations, name, inputs[i], report, image, axes);
      if (!written && !report.error) report.error = written.error();
    }
    return each(report, poses);
  };
  DetectSummary summary =
      detect_all(inputs, finder, job.poses ? &job.poses->camera : nullptr, control, on_picture);
  summary.annotations_failed = annotations->failed;
  const Status closed = annotations->video ? annotations->video->close() : Status();
  if (!closed) {
    control.note(to_string(closed.error()));
    summary.annotations_failed = true;
  }
  return summary;
}

nlohmann::ordered_json to_json(const PictureReport& report, const PoseList& poses, bool with_covariance) {
  nlohmann::ordered_json json = to_json(report, with_covariance);
  for (std::size_t k = 0; k < poses.size(); ++k) add_to_json(json["detections"][k], poses[k]);
  return json;
}

}  // namespace waymark
