#include "waymark/media/opencv/name_markers.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "waymark/media/opencv/marker_dictionary.hpp"

namespace waymark {
namespace {

constexpr int kAprilGridBorder = 2;  // cells

std::size_t count_markers(const cv::Mat& grey, const cv::Ptr<cv::aruco::Dictionary>& dictionary,
                          int border_cells) {
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->markerBorderBits = border_cells;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, dictionary, corners, ids, parameters);
  return std::set<int>(ids.begin(), ids.end()).size();
}

}  // namespace

std::string name_markers(const ImageView& image) {
  constexpr std::size_t kFewest = 4;  // fewer are read into anything
  const cv::Mat grey(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride));
  std::string best;
  std::size_t most = kFewest - 1;
  for (const std::string& name : dictionary_names()) {  // of those that hold all, the first is the smallest
    const std::size_t count = count_markers(grey, *marker_dictionary(name), 1);
    if (count > most) best = name;
    most = std::max(most, count);
  }
  const std::size_t grid = count_markers(grey, *marker_dictionary("apriltag_36h11"), kAprilGridBorder);
  return grid > most ? "aprilgrid" : best;
}

}  // namespace waymark
