#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"

namespace waymark {

/// One thing to process: the path of a picture, or why a SOURCE gave none.
struct Input {
  std::string path{};
  std::optional<Error> error = {};
};

/// The pictures behind the SOURCEs of a command line: a file (of any name), a folder (its files called .jpg
/// .jpeg .png .pgm .ppm .pbm .pnm, any case; those of folders inside it only when `recursive`), or a glob
/// pattern the shell did not expand. In the order given; those of one folder or pattern sorted by name, byte
/// by byte. A picture named twice is processed once. What does not exist, holds no picture, or is a
/// stream is an error of that SOURCE alone; a recording or a video passes as it is.
[[nodiscard]] std::vector<Input> find_inputs(const std::vector<std::string>& sources, bool recursive);

}  // namespace waymark
