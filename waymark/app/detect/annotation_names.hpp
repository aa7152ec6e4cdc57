#pragma once

#include <string>
#include <vector>

namespace waymark {

/// A file name in one folder for each picture: "photo.png" for "a/photo.jpg". Where two pictures would get
/// the same name (compared without case, as some file systems do), each of them is called after its whole
/// path, "a__photo.jpg.png", and should even that collide, numbered. Depends only on the list.
[[nodiscard]] std::vector<std::string> annotation_names(const std::vector<std::string>& pictures);

}  // namespace waymark
