#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One input to process: the path of an image, or the error of a SOURCE.
struct Input {
  std::string path{};
  std::optional<Error> error = {};
};

/// The images of the SOURCEs on a command line. A SOURCE is a file of any name, a folder, or a glob pattern
/// that the shell did not expand. A folder means its .jpg .jpeg .png .pgm .ppm .pbm .pnm files in any case,
/// with `recursive` also those in subfolders. SOURCEs keep their order; the images of a folder or pattern are
/// sorted by the bytes of their names. An image named twice is listed once. A SOURCE that does not exist,
/// contains no image or is a stream yields an error and does not affect the others. Recordings and videos are
/// listed as they are.
[[nodiscard]] std::vector<Input> find_inputs(const std::vector<std::string>& sources, bool recursive);

}  // namespace waymark
