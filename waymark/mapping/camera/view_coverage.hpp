#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

/// Which views of a target are there, and which are missing.
namespace waymark {

/// How a flat target leans towards the camera: the edge, in the picture, that is nearer than the opposite
/// one.
enum class BoardTilt : std::uint8_t { Frontal, LeftNearer, RightNearer, UpperNearer, LowerNearer };

/// Of a target whose z points away from the camera. Frontal: below `least_deg`.
[[nodiscard]] BoardTilt board_tilt(const SE3& target_T_cam, double least_deg = 20);

/// What a set of views shows.
struct ViewCoverage {
  int views = 0;
  std::array<int, 9> corners{};  ///< in each ninth of the picture, row by row from the top left
  std::array<int, 5> tilts{};    ///< views by BoardTilt
};

/// How many corners of a picture are in each of its ninths, row by row from the top left.
[[nodiscard]] std::array<int, 9> corners_by_part(const TargetPicture& marks, int width_px, int height_px);

void add_view(ViewCoverage& coverage, const TargetPicture& marks, const SE3& target_T_cam, int width_px,
              int height_px);

struct CoverageOptions {
  int views = 12;
  int corners_each_part = 20;
  int views_each_tilt = 2;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.views, Field{"views", "Number of views below which more are asked for.", 3, 1000});
    visit(self.corners_each_part,
          Field{"corners_each_part", "Number of corners that each ninth of the picture needs.", 1, 100000});
    visit(
        self.views_each_tilt,
        Field{"views_each_tilt", "Number of views that each of the four directions of tilt needs.", 1, 1000});
  }
};

/// What is missing, in words for who holds the board, most important first; empty: nothing.
[[nodiscard]] std::vector<std::string> missing_views(const ViewCoverage& coverage,
                                                     const CoverageOptions& options = {});

/// The tilts that are asked for, with the edge that is nearer: "left", "right", "upper", "lower".
[[nodiscard]] const std::array<std::pair<BoardTilt, const char*>, 4>& tilts_with_edges();

/// "top left", … "bottom right": the ninths of a picture.
[[nodiscard]] const std::array<const char*, 9>& image_part_names();

}  // namespace waymark
