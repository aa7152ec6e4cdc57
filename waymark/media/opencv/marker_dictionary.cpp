#include "waymark/media/opencv/marker_dictionary.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/media/opencv/find_board.hpp"

namespace waymark {
namespace {

using cv::aruco::PREDEFINED_DICTIONARY_NAME;
using Named = std::pair<std::string_view, PREDEFINED_DICTIONARY_NAME>;

constexpr std::array<Named, 21> kDictionaries = {{{"4x4_50", cv::aruco::DICT_4X4_50},
                                                  {"4x4_100", cv::aruco::DICT_4X4_100},
                                                  {"4x4_250", cv::aruco::DICT_4X4_250},
                                                  {"4x4_1000", cv::aruco::DICT_4X4_1000},
                                                  {"5x5_50", cv::aruco::DICT_5X5_50},
                                                  {"5x5_100", cv::aruco::DICT_5X5_100},
                                                  {"5x5_250", cv::aruco::DICT_5X5_250},
                                                  {"5x5_1000", cv::aruco::DICT_5X5_1000},
                                                  {"6x6_50", cv::aruco::DICT_6X6_50},
                                                  {"6x6_100", cv::aruco::DICT_6X6_100},
                                                  {"6x6_250", cv::aruco::DICT_6X6_250},
                                                  {"6x6_1000", cv::aruco::DICT_6X6_1000},
                                                  {"7x7_50", cv::aruco::DICT_7X7_50},
                                                  {"7x7_100", cv::aruco::DICT_7X7_100},
                                                  {"7x7_250", cv::aruco::DICT_7X7_250},
                                                  {"7x7_1000", cv::aruco::DICT_7X7_1000},
                                                  {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL},
                                                  {"apriltag_16h5", cv::aruco::DICT_APRILTAG_16h5},
                                                  {"apriltag_25h9", cv::aruco::DICT_APRILTAG_25h9},
                                                  {"apriltag_36h10", cv::aruco::DICT_APRILTAG_36h10},
                                                  {"apriltag_36h11", cv::aruco::DICT_APRILTAG_36h11}}};

std::string plain(std::string_view name) {
  constexpr std::string_view kPrefix = "dict_";
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower.starts_with(kPrefix) ? lower.substr(kPrefix.size()) : lower;
}

}  // namespace

std::vector<std::string> dictionary_names() {
  std::vector<std::string> names;
  names.reserve(kDictionaries.size());
  for (const Named& one : kDictionaries) names.emplace_back(one.first);
  return names;
}

Result<cv::Ptr<cv::aruco::Dictionary>> marker_dictionary(const std::string& name) {
  const std::string wanted = plain(name);
  const auto known = std::ranges::find(kDictionaries, wanted, &Named::first);
  if (known != kDictionaries.end()) return cv::aruco::getPredefinedDictionary(known->second);
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown dictionary '{}'", name.substr(0, 60)),
              {.key = "dictionary"}, suggestion(wanted, dictionary_names()));
}

Result<MarkerCells> marker_cells(const std::string& name, int number) {
  const auto dictionary = marker_dictionary(name);
  if (!dictionary) return tl::unexpected(dictionary.error());
  const cv::aruco::Dictionary& markers = **dictionary;
  if (number < 0 || number >= markers.bytesList.rows)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the dictionary {} has no marker {}", plain(name), number), {.key = "dictionary"},
                fmt::format("Its numbers are 0 to {}.", markers.bytesList.rows - 1));
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
      markers.bytesList.rowRange(number, number + 1), markers.markerSize);
  MarkerCells cells{.width = markers.markerSize};
  for (int y = 0; y < bits.rows; ++y)
    for (int x = 0; x < bits.cols; ++x) cells.black.push_back(bits.at<std::uint8_t>(y, x) == 0);
  return cells;
}

}  // namespace waymark
