#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One input to process: the path of an image, or the error for a SOURCE.
struct Input {
  std::string path{};
  std::optional<Error> error = {};
};

/// Lists the images for the SOURCEs on a command line. A SOURCE is a file with any name, a folder, or a glob
/// pattern that the shell did not expand. A folder stands for its .jpg .jpeg .png .pgm .ppm .pbm .pnm files
/// (case-insensitive) and, with `recursive`, for those in its subfolders. SOURCEs keep their order; the
/// images in a folder or pattern are sorted by the bytes of their names. An image specified twice is listed
/// once. A SOURCE that does not exist, contains no image or is a stream yields an error and does not affect
/// the others. Recordings (also folders of them, if they contain no image) and videos are listed unchanged.
[[nodiscard]] std::vector<Input> find_inputs(const std::vector<std::string>& sources, bool recursive);

}  // namespace waymark
