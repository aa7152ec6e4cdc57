#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/picture_files.hpp"
#include "waymark/media/video_writer.hpp"

namespace waymark {

/// A file name in one folder for each picture: "photo.png" for "a/photo.jpg". Where two pictures would get
/// the same name (compared without case, as some file systems do), each of them is called after its whole
/// path, "a__photo.jpg.png", and should even that collide, numbered. Depends only on the list.
[[nodiscard]] std::vector<std::string> annotation_names(const std::vector<std::string>& pictures);

/// Annotated pictures as a video: as large as the first, with their stamps; pictures without stamps follow
/// each other at the nominal rate.
class AnnotatedVideo {
 public:
  /// Refuses to write over one of the inputs. Rate and rotation are those of the first video among them.
  [[nodiscard]] static Result<AnnotatedVideo> create(const std::string& path,
                                                     const std::vector<Input>& inputs);

  [[nodiscard]] Status add(const ColorImage& picture, std::optional<SensorTime> stamp);
  /// Puts the file in its place; without any picture there is none.
  [[nodiscard]] Status close();

 private:
  std::filesystem::path path_{};
  VideoWriterOptions options_{};
  std::optional<VideoWriter> writer_{};
  std::optional<SensorTime> last_{};  ///< in the video that is written
  Duration shift_{};                  ///< of the stamps, if a further input restarts at zero
};

}  // namespace waymark
