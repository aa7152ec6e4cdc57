#pragma once

#include <string>

#include "waymark/image/image.hpp"

namespace waymark {

/// What BoardFinder::name_markers() promises.
[[nodiscard]] std::string name_markers(const ImageView& image);

}  // namespace waymark
