#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/image_files.hpp"
#include "waymark/media/video_writer.hpp"

namespace waymark {

/// Unique file names for annotated images in one folder: "photo.png" for "a/photo.jpg". If two names would
/// collide (case is ignored, as in some file systems), both contain the whole path: "a__photo.jpg.png". If
/// these also collide, numbers are appended. The result depends only on the list.
[[nodiscard]] std::vector<std::string> annotation_names(const std::vector<std::string>& images);

/// Writes annotated images to a video, which has the size of the first image and the timestamps of all of
/// them. Images without timestamps are spaced at the video's frame rate.
class AnnotatedVideo {
 public:
  /// Fails if `path` is one of the inputs. The rate and rotation are taken from the first video among the
  /// inputs.
  [[nodiscard]] static Result<AnnotatedVideo> create(const std::string& path,
                                                     const std::vector<Input>& inputs);

  [[nodiscard]] Status add(const ColorImage& image, std::optional<SensorTime> stamp);
  /// Completes the file. If there are no images, no file is written.
  [[nodiscard]] Status close();

 private:
  std::filesystem::path path_{};
  VideoWriterOptions options_{};
  std::optional<VideoWriter> writer_{};
  std::optional<SensorTime> last_{};  ///< timestamp of the last image in the output
  Duration shift_{};                  ///< added to timestamps, because each input starts at zero
};

}  // namespace waymark
