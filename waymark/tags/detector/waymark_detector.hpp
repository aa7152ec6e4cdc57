#pragma once

#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// Waymark's own detector. docs/concepts/detection.md describes the method, and docs/results/detection.md
/// compares its detection rate and cost with those of other detectors. It uses the options families,
/// max_hamming, min_decision_margin, min_white_black_diff and find_inverted. Setting an option of AprilTag 3
/// to anything other than its default is an error.
///
/// detect() works directly on images of any stride, in a single thread. Images larger than kMaxImagePixels
/// are rejected. Thread-safe: each concurrent call uses a separate workspace, which is kept for later calls,
/// so after the first image only the result is allocated.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_waymark_detector(const DetectorOptions& options = {});

}  // namespace waymark
