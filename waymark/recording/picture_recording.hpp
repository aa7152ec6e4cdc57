#pragma once

#include <string>

#include "waymark/recording/sample_recorder.hpp"

/// How pictures get into a recording (--record-images, --pictures).
namespace waymark {

/// Writes a picture as `how` says: raw; jpeg, a tenth as large; empty: not at all.
[[nodiscard]] Status record_picture(const CameraFrame& picture, const std::string& how,
                                    SampleRecorder& recorder);

}  // namespace waymark
