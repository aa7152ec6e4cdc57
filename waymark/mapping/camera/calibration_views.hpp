#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

/// Which pictures of a live camera are taken for a calibration, which views of the target are there, and
/// which are missing.
namespace waymark {

struct CaptureOptions {
  double still_px_s = 60;
  double new_share = 0.05;
  double widest_edge_px = 2.5;
  int fewest_corners = 16;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.still_px_s,
          Field{"still_px_s", "Speed of the corners above which a picture is not taken [px/s].", 1, 1e5});
    visit(self.new_share, Field{"new_share",
                                "Mean distance of the corners from every view taken so far that makes a "
                                "view new, as a share of the "
                                "image's diagonal.",
                                0, 1});
    visit(self.widest_edge_px, Field{"widest_edge_px",
                                     "Width of the edges at the corners, as the standard deviation of a "
                                     "blur, above which a picture is not "
                                     "taken [px].",
                                     0.3, 100});
    visit(self.fewest_corners,
          Field{"fewest_corners", "Smallest number of corners in a picture that is taken.", 8, 100000});
  }
};

/// What becomes of a picture.
enum class CaptureVerdict : std::uint8_t { NoTarget, TooFew, Moving, Blurred, Known, New };

/// "no board in view", "hold still", …; for who holds the board.
[[nodiscard]] std::string_view to_string(CaptureVerdict verdict);

/// How wide the edges are at the corners: the median over the corners of the blur's standard deviation that
/// gives the steepest slope near a corner as a share of the contrast there [px]. Nothing without a corner
/// within the image. O(corners).
[[nodiscard]] std::optional<double> edge_width_px(const ImageView& image, const TargetPicture& marks);

/// Chooses among the pictures of a stream: those that stand still, are sharp, and show the target where it
/// was not yet. Stillness is judged against the pictures before, twice in a row.
class ViewCapture {
 public:
  explicit ViewCapture(const CaptureOptions& options = {}) : options_(options) {}

  /// The next picture of the stream. New: it is one of the views from now on. O(views * marks).
  [[nodiscard]] CaptureVerdict take(SensorTime stamp, const ImageView& image, const TargetPicture& marks);
  /// A view that was taken before.
  void add(TargetPicture marks) { views_.push_back(std::move(marks)); }

 private:
  [[nodiscard]] bool still(SensorTime stamp, const TargetPicture& marks);

  CaptureOptions options_;
  std::vector<TargetPicture> views_{};
  TargetPicture last_{};
  SensorTime last_stamp_{};
  int still_times_ = 0;
};

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
