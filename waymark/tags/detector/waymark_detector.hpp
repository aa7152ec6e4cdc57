#pragma once

#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// The detector of this project: docs/concepts/detection.md describes the method, docs/results/detection.md
/// its detection rate and cost compared with others. It uses the options families, max_hamming,
/// min_decision_margin, min_white_black_diff and find_inverted; an option of AprilTag 3 that differs from its
/// default is an error.
///
/// detect() works in place on images of any stride, on one thread; images beyond kMaxImagePixels are
/// rejected. Thread-safe: each concurrent call uses a separate workspace, which is kept for later calls, so
/// after the first image only the result is allocated.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_waymark_detector(const DetectorOptions& options = {});

}  // namespace waymark
