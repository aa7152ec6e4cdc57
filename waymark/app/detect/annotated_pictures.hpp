#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/picture_files.hpp"
#include "waymark/media/video_writer.hpp"

namespace waymark {

/// Unique file names for annotated pictures in one folder: "photo.png" for "a/photo.jpg". If two names would
/// collide (ignoring case, like some file systems), both contain the whole path: "a__photo.jpg.png". If these
/// collide as well, numbers are appended. The result depends only on the list.
[[nodiscard]] std::vector<std::string> annotation_names(const std::vector<std::string>& pictures);

/// Writes annotated pictures as a video with the size of the first picture and the stamps of all. Pictures
/// without timestamps are spaced at the video's frame rate.
class AnnotatedVideo {
 public:
  /// Fails if `path` is one of the inputs. Rate and rotation are those of the first video among them.
  [[nodiscard]] static Result<AnnotatedVideo> create(const std::string& path,
                                                     const std::vector<Input>& inputs);

  [[nodiscard]] Status add(const ColorImage& picture, std::optional<SensorTime> stamp);
  /// Completes the file; without pictures no file is written.
  [[nodiscard]] Status close();

 private:
  std::filesystem::path path_{};
  VideoWriterOptions options_{};
  std::optional<VideoWriter> writer_{};
  std::optional<SensorTime> last_{};  ///< stamp of the last picture in the output
  Duration shift_{};                  ///< added to stamps, as each input starts at zero
};

}  // namespace waymark
