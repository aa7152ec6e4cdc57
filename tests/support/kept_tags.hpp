#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/tags/refinement/cell_steps.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/refinement/edge_model.hpp"

/// Tags that are detected but not refined, with the errors of their corners.
namespace waymark::testing {

/// Name of a set of degraded images, and a number of images that contain about as many such tags as the
/// others.
struct KeptSet {
  std::string name;
  std::size_t images = 0;
};
[[nodiscard]] const std::vector<KeptSet>& kept_sets();

struct Kept {
  RefinedCorners corners;
  refinement::PrintedTag print;
  refinement::StepPlacement steps;
  Eigen::Matrix<double, 8, 1> error;     ///< of the kept corners [px]
  Eigen::Matrix<double, 8, 1> detected;  ///< of the detected corners [px]
};

/// All tags of a set that are detected but not refined.
[[nodiscard]] std::vector<Kept> kept_tags(const std::string& set, std::size_t images, std::uint64_t seed);

}  // namespace waymark::testing
