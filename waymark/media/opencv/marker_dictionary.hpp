#pragma once

#include <string>
#include <vector>

#include <opencv2/aruco.hpp>

#include "waymark/base/error.hpp"

namespace waymark {

/// A dictionary of OpenCV by its name, "4x4_50" or "DICT_4X4_50". Fails with the nearest name.
[[nodiscard]] Result<cv::Ptr<cv::aruco::Dictionary>> marker_dictionary(const std::string& name);

/// The names of all, of each width the smallest first.
[[nodiscard]] std::vector<std::string> dictionary_names();

}  // namespace waymark
