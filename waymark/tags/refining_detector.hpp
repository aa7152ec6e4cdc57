#pragma once

#include <memory>
#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/tags/detector.hpp"
#include "waymark/tags/refinement.hpp"

namespace waymark {

/// A detector whose corners are refined in the image: every detection of `detector` comes with refined
/// corners and their covariance, or, where the fit was not usable, with its own corners and the covariance of
/// unrefined_sigma_px. None is dropped: what is a tag is the detector's business.
///
/// With `camera`, edges are bent as its distortion bends straight lines. Fails on options out of range and on
/// a missing detector. Safe to call from several threads where `detector` is.
[[nodiscard]] Result<std::unique_ptr<Detector>> make_refining_detector(
    std::unique_ptr<Detector> detector, const RefinementOptions& options = {},
    std::optional<CameraModel> camera = std::nullopt);

/// The detection with refined corners and their covariance, as make_refining_detector() gives it.
[[nodiscard]] TagDetection refined(const ImageView& image, TagDetection detection,
                                   const RefinementOptions& options = {},
                                   const CameraModel* camera = nullptr);

}  // namespace waymark
