#pragma once

#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// The detector that options.detector names.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_detector(const DetectorOptions& options = {});

}  // namespace waymark
