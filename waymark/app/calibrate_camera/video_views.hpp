#pragma once

#include <cstddef>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

namespace waymark {

/// Which pictures of a video are views worth calibrating on.
struct VideoViewOptions {
  double fastest_px_s = 60;  ///< corners move no faster: their blur and the rolling shutter stay small
  double new_view_share = 0.04;
  int most_views = 60;
  int fewest_tags = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.fastest_px_s,
          Field{"fastest_px_s",
                "Speed of the corners in the image above which a picture of a video is left out [px/s].", 1,
                1e5});
    visit(self.new_view_share,
          Field{"new_view_share",
                "Mean distance of the corners from every view taken so far that makes a view of a video new, "
                "as a share of the image's diagonal.",
                0, 1});
    visit(self.most_views,
          Field{"most_views", "Largest number of views that are taken from a video.", 4, 10000});
    visit(
        self.fewest_tags,
        Field{"fewest_tags",
              "Smallest number of tags in a view that is taken from a video; of a board's corners four times "
              "as many.",
              1, 1000});
  }
};

/// What one picture of a video shows of the target.
struct StampedMarks {
  SensorTime stamp{};
  TargetPicture marks{};
};

/// The indices of the still and new views, ascending: pictures in which the corners move slowest against
/// their neighbours, each far enough from all taken before; where there are more than `most_views`, those
/// farthest from each other. `diagonal_px` is that of the pictures. O(pictures * views * marks).
[[nodiscard]] std::vector<std::size_t> choose_views(const std::vector<StampedMarks>& pictures,
                                                    double diagonal_px, const VideoViewOptions& options = {});

}  // namespace waymark
