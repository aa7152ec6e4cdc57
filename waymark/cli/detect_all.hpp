#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "waymark/cli/console.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/image/image.hpp"
#include "waymark/jobs/picture_files.hpp"
#include "waymark/jobs/tag_finder.hpp"

namespace waymark::cli {

/// What became of a list of inputs.
struct DetectSummary {
  std::size_t pictures = 0;  ///< processed without an error
  std::size_t tags = 0;
  std::size_t failed = 0;
  bool stopped = false;  ///< by Ctrl-C, before the end of the list

  [[nodiscard]] ExitCode exit_code() const;
};

/// Called with each report, in the order of the inputs; `image` is empty when the picture could not be read.
/// May add an error to the report, which then counts as failed.
using EachPicture = std::function<void(std::size_t index, PictureReport& report, const Image& image)>;

/// Reads each input, all pictures of a recording, and finds their tags. Errors are said and the next input is
/// taken; Ctrl-C and the end of the output stop between two pictures.
[[nodiscard]] DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder,
                                       Console& console, const EachPicture& each);

}  // namespace waymark::cli
