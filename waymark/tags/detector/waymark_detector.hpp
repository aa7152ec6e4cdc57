#pragma once

#include <memory>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// The detector of this project: docs/concepts/detection.md says how it works, docs/results/detection.md what
/// it finds and costs beside others. Of the options it uses families, max_hamming, min_decision_margin,
/// min_white_black_diff and find_inverted; one of AprilTag 3's own that is not at its default is an error.
///
/// detect() works on the image where it lies, with any stride, on one thread; images beyond kMaxImagePixels
/// are refused. Several threads may call it at once: each gets a workspace of its own, kept for later calls,
/// so that nothing is allocated after the first image but the answer.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_waymark_detector(const DetectorOptions& options = {});

}  // namespace waymark
