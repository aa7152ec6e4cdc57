#pragma once

#include <array>

#include "waymark/camera/camera_model.hpp"
#include "waymark/tags/edge_band.hpp"

namespace waymark::refinement {

/// How edges bend in the image. With a camera model the bulge of a straight line is computed and written to
/// EdgeFrame::bulge_px; where there is none (or it does not reach), it is 0. What comes back is how far the
/// fit may bend each edge beyond that [px, standard deviation]: a tenth of what the camera model says, or the
/// sagitta of `curvature_per_px` over the length of the edge.
std::array<double, 4> expect_bends(const CameraModel* camera, double curvature_per_px,
                                   std::array<EdgeFrame, 4>& edges);

}  // namespace waymark::refinement
