#pragma once

#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// Creates the detector named by options.detector.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_detector(const DetectorOptions& options = {});

}  // namespace waymark
