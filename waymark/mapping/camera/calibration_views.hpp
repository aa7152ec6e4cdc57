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

/// Selection of images from a live camera for a calibration, and coverage by the views captured so far.
namespace waymark {

struct CaptureOptions {
  double still_px_s = 60;
  double new_share = 0.05;
  double widest_edge_px = 2.5;
  int fewest_corners = 16;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.still_px_s,
          Field{"still_px_s", "Speed of the corners above which an image is not used [px/s].", 1, 1e5});
    visit(self.new_share, Field{"new_share",
                                "Mean distance of the corners from every view taken so far that makes a "
                                "view new, as a share of the "
                                "image's diagonal.",
                                0, 1});
    visit(self.widest_edge_px, Field{"widest_edge_px",
                                     "Width of the edges at the corners, as the standard deviation of a "
                                     "blur, above which an image is not "
                                     "used [px].",
                                     0.3, 100});
    visit(self.fewest_corners,
          Field{"fewest_corners", "Minimum number of corners in an image that is used.", 8, 100000});
  }
};

/// The decision about an image.
enum class CaptureVerdict : std::uint8_t { NoTarget, TooFew, Moving, Blurred, Known, New };

/// The text shown to the person who holds the board: "no board in view", "hold still", …
[[nodiscard]] std::string_view to_string(CaptureVerdict verdict);

/// Edge width at the corners [px]. It is the standard deviation of a blur that results in the same steepest
/// slope relative to the local contrast; the median over the corners is returned. Empty if no corner lies
/// within the image. O(corners).
[[nodiscard]] std::optional<double> edge_width_px(const ImageView& image, const TargetMarks& marks);

/// Selects images from a stream that are sharp, that show the board at rest, and that differ from all earlier
/// views. The board counts as at rest after two successive images without motion.
class ViewCapture {
 public:
  explicit ViewCapture(const CaptureOptions& options = {}) : options_(options) {}

  /// Decides whether to use the next image of the stream; an image with the verdict New is added to the
  /// views. O(views * marks).
  [[nodiscard]] CaptureVerdict take(SensorTime stamp, const ImageView& image, const TargetMarks& marks);
  /// Adds a view from an earlier run.
  void add(TargetMarks marks) { views_.push_back(std::move(marks)); }

 private:
  [[nodiscard]] bool still(SensorTime stamp, const TargetMarks& marks);

  CaptureOptions options_;
  std::vector<TargetMarks> views_{};
  TargetMarks last_{};
  SensorTime last_stamp_{};
  int still_times_ = 0;
};

/// Tilt of a flat target relative to the camera, named after the nearer edge in the image.
enum class BoardTilt : std::uint8_t { Frontal, LeftNearer, RightNearer, UpperNearer, LowerNearer };

/// The tilt of a target whose z axis points away from the camera. It is Frontal if the angle is below
/// `min_tilt_deg`.
[[nodiscard]] BoardTilt board_tilt(const SE3& target_T_cam, double min_tilt_deg = 20);

/// How well a set of views covers the image and the tilts.
struct ViewCoverage {
  int views = 0;
  /// Number of corners in each ninth of the image, row by row from the top left.
  std::array<int, 9> corners{};
  std::array<int, 5> tilts{};  ///< number of views for each BoardTilt
};

/// Number of corners in each ninth of the image, row by row from the top left.
[[nodiscard]] std::array<int, 9> corners_by_part(const TargetMarks& marks, int width_px, int height_px);

void add_view(ViewCoverage& coverage, const TargetMarks& marks, const SE3& target_T_cam, int width_px,
              int height_px);

struct CoverageOptions {
  int views = 12;
  int corners_each_part = 20;
  int views_each_tilt = 2;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.views, Field{"views", "Minimum number of views.", 3, 1000});
    visit(self.corners_each_part,
          Field{"corners_each_part", "Minimum number of corners in each ninth of the image.", 1, 100000});
    visit(self.views_each_tilt,
          Field{"views_each_tilt", "Minimum number of views for each of the four tilt directions.", 1, 1000});
  }
};

/// Instructions for capturing the missing views, for the person who holds the board; the most important one
/// is first. The list is empty if coverage is complete.
[[nodiscard]] std::vector<std::string> missing_views(const ViewCoverage& coverage,
                                                     const CoverageOptions& options = {});

/// The required tilts, each with the name of the nearer edge: "left", "right", "upper" or "lower".
[[nodiscard]] const std::array<std::pair<BoardTilt, const char*>, 4>& tilts_with_edges();

/// Names of the ninths of an image, from "top left" to "bottom right".
[[nodiscard]] const std::array<const char*, 9>& image_part_names();

}  // namespace waymark
