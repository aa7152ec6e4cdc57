#include "waymark/media/opencv/find_board.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/base/error.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/base/order_statistics.hpp"

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

/// All names, with the smallest dictionary of each width first.
std::vector<std::string> dictionary_names() {
  std::vector<std::string> names;
  names.reserve(kDictionaries.size());
  for (const Named& one : kDictionaries) names.emplace_back(one.first);
  return names;
}

/// The OpenCV dictionary with a name such as "4x4_50" or "DICT_4X4_50". The error for an unknown name
/// suggests the nearest one.
Result<cv::Ptr<cv::aruco::Dictionary>> marker_dictionary(const std::string& name) {
  const std::string wanted = plain(name);
  const auto entry = std::ranges::find(kDictionaries, wanted, &Named::first);
  if (entry != kDictionaries.end()) return cv::aruco::getPredefinedDictionary(entry->second);
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown dictionary '{}'", name.substr(0, 60)),
              {.key = "dictionary"}, suggestion(wanted, dictionary_names()));
}

constexpr int kAprilGridBorder = 2;  // in cells

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

Result<MarkerCells> marker_cells(const std::string& name, int number) {
  const auto dictionary = marker_dictionary(name);
  if (!dictionary) return tl::unexpected(dictionary.error());
  const cv::aruco::Dictionary& markers = **dictionary;
  if (number < 0 || number >= markers.bytesList.rows)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the dictionary {} has no marker {}", plain(name), number), {.key = "dictionary"},
                fmt::format("Its markers have the numbers 0 to {}.", markers.bytesList.rows - 1));
  const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(
      markers.bytesList.rowRange(number, number + 1), markers.markerSize);
  MarkerCells cells{.width = markers.markerSize};
  for (int y = 0; y < bits.rows; ++y)
    for (int x = 0; x < bits.cols; ++x) cells.black.push_back(bits.at<std::uint8_t>(y, x) == 0);
  return cells;
}

std::string name_markers(const ImageView& image) {
  constexpr std::size_t kMinMarkers = 4;  // fewer may be misread
  const cv::Mat grey(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride));
  std::string best;
  std::size_t most = kMinMarkers - 1;
  for (const std::string& name : dictionary_names()) {  // the first that contains all of them is the smallest
    const std::size_t count = count_markers(grey, *marker_dictionary(name), 1);
    if (count > most) best = name;
    most = std::max(most, count);
  }
  const std::size_t grid = count_markers(grey, *marker_dictionary("apriltag_36h11"), kAprilGridBorder);
  return grid > most ? "aprilgrid" : best;
}

namespace {

constexpr double kHalfPixel = 0.5;  // OpenCV's pixel centres are at integers

cv::Mat as_mat(const ImageView& image) {
  // OpenCV has no type for read-only pixels.
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

BoardCorner corner_at(int number, const cv::Point2f& point) {
  return {.number = number, .px = {point.x + kHalfPixel, point.y + kHalfPixel}};
}

/// Searches coarsely on a smaller image first, because the exact search is slow on images without a
/// chessboard.
bool may_show_chessboard(const cv::Mat& grey, const cv::Size& inner) {
  constexpr int kSmallSide = 640;
  const double scale = static_cast<double>(kSmallSide) / std::max(grey.cols, grey.rows);
  cv::Mat small = grey;
  if (scale < 1) cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return cv::checkChessboard(small, inner) || cv::checkChessboard(grey, inner);
}

/// The markers of a board found in an image, by number; duplicates are omitted.
using SeenMarkers = std::map<int, std::vector<cv::Point2f>>;

Result<SeenMarkers> find_markers(const cv::Mat& grey, const std::string& name, int border_cells,
                                 int markers_needed) {
  const auto dictionary = marker_dictionary(name);
  if (!dictionary) return tl::unexpected(dictionary.error());
  if (markers_needed > (*dictionary)->bytesList.rows)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the board has markers up to number {}, but the dictionary {} has only {}",
                            markers_needed - 1, name, (*dictionary)->bytesList.rows),
                {.key = "dictionary"}, "Use a larger dictionary.");
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->markerBorderBits = border_cells;
  parameters->adaptiveThreshWinSizeMax = std::max(23, std::min(grey.cols, grey.rows) / 16 | 1);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, *dictionary, corners, ids, parameters);
  SeenMarkers seen;
  std::map<int, int> times;
  for (const int id : ids) ++times[id];
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (times[ids[i]] == 1 && ids[i] < markers_needed) seen[ids[i]] = corners[i];
  return seen;
}

double distance_px(const cv::Point2f& a, const cv::Point2f& b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// A corner to be refined, and a radius around it that contains no other edges.
struct Guess {
  int number = 0;
  cv::Point2f at{};
  double free_px = 0;
};

/// Refines each corner within its radius; drops corners that leave it.
std::vector<BoardCorner> refine(const cv::Mat& grey, const std::vector<Guess>& guesses) {
  constexpr double kLargestWindow = 10;
  constexpr double kShareOfFree = 0.7;
  std::vector<BoardCorner> corners;
  for (const Guess& guess : guesses) {
    const int window = static_cast<int>(std::min(kLargestWindow, kShareOfFree * guess.free_px));
    const cv::Point2f& at = guess.at;
    const auto margin = static_cast<float>(window);
    if (window < 2 || at.x < margin || at.y < margin || at.x > static_cast<float>(grey.cols - 1) - margin ||
        at.y > static_cast<float>(grey.rows - 1) - margin)
      continue;
    std::vector<cv::Point2f> point{at};
    cv::cornerSubPix(grey, point, {window, window}, {-1, -1},
                     {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-3});
    // OpenCV resets a corner that diverges to exactly its initial position.
    if (point.front() != at && distance_px(point.front(), at) < window)
      corners.push_back(corner_at(guess.number, point.front()));
  }
  return corners;
}

std::vector<BoardCorner> find_chessboard(const cv::Mat& grey, const CalibrationBoard& board) {
  const cv::Size inner(board.columns - 1, board.rows - 1);
  constexpr double kShareOfSquare = 0.6;
  std::vector<cv::Point2f> points;
  if (!may_show_chessboard(grey, inner) ||
      !cv::findChessboardCornersSB(grey, inner, points, cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY))
    return {};
  // OpenCV's corner is up to a third of a pixel off on a tilted board; refining to the saddle point reduces
  // that.
  std::vector<Guess> guesses;
  guesses.reserve(points.size());
  const auto columns = static_cast<std::size_t>(inner.width);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t beside = i % columns + 1 < columns ? i + 1 : i - 1;
    const std::size_t below = i + columns < points.size() ? i + columns : i - columns;
    const double square_px =
        std::min(distance_px(points[i], points[beside]), distance_px(points[i], points[below]));
    guesses.push_back({static_cast<int>(i), points[i], kShareOfSquare * square_px});
  }
  return refine(grey, guesses);
}

/// The corner at `corner_m` predicted from the marker, using the homography of its square.
cv::Point2f predicted_corner(const BoardMarker& marker, const std::vector<cv::Point2f>& seen,
                             const Eigen::Vector2d& corner_m) {
  const auto half = static_cast<float>(0.5 * marker.size_m);
  const std::array<cv::Point2f, 4> square = {
      cv::Point2f{-half, -half}, {half, -half}, {half, half}, {-half, half}};
  const cv::Mat homography = cv::getPerspectiveTransform(square.data(), seen.data());
  std::vector<cv::Point2f> point{{static_cast<float>(corner_m.x() - marker.middle_m.x()),
                                  static_cast<float>(corner_m.y() - marker.middle_m.y())}};
  cv::perspectiveTransform(point, point, homography);
  return point.front();
}

/// A corner between two markers, estimated from those of the two that were found. Empty if their estimates
/// contradict each other.
std::optional<Guess> guess_between(int number, const Eigen::Vector2d& corner_m, const CalibrationBoard& board,
                                   const std::vector<BoardMarker>& markers, const SeenMarkers& seen) {
  std::vector<cv::Point2f> guesses;
  double free_px = 1e9;
  for (const BoardMarker& marker : markers) {
    const auto found = seen.find(marker.id);
    if (found == seen.end() || (marker.middle_m - corner_m).norm() > board.size_m) continue;
    guesses.push_back(predicted_corner(marker, found->second, corner_m));
    for (const cv::Point2f& point : found->second)
      free_px = std::min(free_px, distance_px(point, guesses.back()));
  }
  if (guesses.empty()) return std::nullopt;
  const cv::Point2f at = 0.5F * (guesses.front() + guesses.back());
  if (distance_px(guesses.front(), guesses.back()) > free_px) return std::nullopt;
  return Guess{number, at, free_px};
}

/// Side of a marker divided by the side of its square, using the homography of the square. If edges are wide,
/// the detector's corners lie inside the marker, so they are refined.
double share_of_square(const cv::Mat& grey, const std::array<cv::Point2f, 4>& square,
                       std::vector<cv::Point2f> marker) {
  constexpr double kShareOfSide = 1.0 / 16;  // half a cell
  const int window = std::max(2, static_cast<int>(kShareOfSide * distance_px(marker[0], marker[2])));
  cv::cornerSubPix(grey, marker, {window, window}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-3});
  const std::array<cv::Point2f, 4> unit = {cv::Point2f{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::vector<cv::Point2f> inside;
  cv::perspectiveTransform(marker, inside, cv::getPerspectiveTransform(square.data(), unit.data()));
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) sum += distance_px(inside[k], inside[(k + 1) % 4]);
  return sum / 4;
}

/// The median over the markers whose squares have all four corners; empty if too few markers qualify.
std::optional<double> share_of_squares(const cv::Mat& grey, const CalibrationBoard& board,
                                       const SeenMarkers& seen, const std::vector<BoardCorner>& corners) {
  constexpr std::size_t kMinMarkers = 4;
  std::map<int, cv::Point2f> at;
  for (const BoardCorner& corner : corners)
    at[corner.number] = {static_cast<float>(corner.px.x() - kHalfPixel),
                         static_cast<float>(corner.px.y() - kHalfPixel)};
  std::vector<double> shares;
  const int inner = board.columns - 1;
  for (const BoardMarker& marker : board_markers(board)) {
    const auto cells = [&](double middle_m, int count) {
      return static_cast<int>(std::lround(middle_m / board.size_m + 0.5 * (count - 1)));
    };
    const int column = cells(marker.middle_m.x(), board.columns);
    const int row = cells(marker.middle_m.y(), board.rows);
    const int first = (row - 1) * inner + column - 1;  // the corner at the square's upper left
    const std::array<int, 4> around = {first, first + 1, first + inner + 1, first + inner};
    const auto found = seen.find(marker.id);
    const bool within = column > 0 && row > 0 && column < inner && row + 1 < board.rows;
    if (!within || found == seen.end() ||
        !std::ranges::all_of(around, [&](int number) { return at.contains(number); }))
      continue;
    shares.push_back(
        share_of_square(grey, {at[around[0]], at[around[1]], at[around[2]], at[around[3]]}, found->second));
  }
  if (shares.size() < kMinMarkers) return std::nullopt;
  return median(std::move(shares));
}

Result<FoundBoard> find_charuco(const cv::Mat& grey, const CalibrationBoard& board) {
  const std::vector<BoardMarker> markers = board_markers(board);
  const auto seen = find_markers(grey, board.dictionary, 1, markers.back().id + 1);
  if (!seen) return tl::unexpected(seen.error());
  std::vector<Guess> guesses;
  int number = 0;
  for (const Eigen::Vector2d& corner : board_corners(board)) {
    if (const auto guess = guess_between(number, corner, board, markers, *seen)) guesses.push_back(*guess);
    ++number;
  }
  FoundBoard found{.corners = refine(grey, guesses)};
  found.marker_share = share_of_squares(grey, board, *seen, found.corners);
  return found;
}

/// Finds the tag corners of an AprilGrid; each is also the corner of a black square. OpenCV's tags of this
/// family are rotated by 180 degrees, so they begin with the lower right corner.
Result<FoundBoard> find_april_grid(const cv::Mat& grey, const CalibrationBoard& board) {
  constexpr int kBorderCells = 2;
  const std::vector<BoardMarker> tags = board_markers(board);
  const auto seen = find_markers(grey, "apriltag_36h11", kBorderCells, tags.back().id + 1);
  if (!seen) return tl::unexpected(seen.error());
  constexpr double kBorderShare = 0.2;  // two of ten cells
  std::vector<Guess> guesses;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const auto found = seen->find(tags[i].id);
    if (found == seen->end()) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& points = found->second;
      const double side_px =
          std::min(distance_px(points[k], points[(k + 1) % 4]), distance_px(points[k], points[(k + 3) % 4]));
      guesses.push_back({static_cast<int>(4 * i + (k + 2) % 4), points[k],
                         std::min(kBorderShare, board.spacing) * side_px});
    }
  }
  return FoundBoard{.corners = refine(grey, guesses)};
}

}  // namespace

Result<FoundBoard> find_board(const ImageView& image, const CalibrationBoard& board) {
  if (image.empty()) return FoundBoard();
  const cv::Mat grey = as_mat(image);
  switch (board.kind) {
    case BoardKind::Chessboard:
      return FoundBoard{.corners = find_chessboard(grey, board)};
    case BoardKind::Charuco:
      return find_charuco(grey, board);
    case BoardKind::AprilGrid:
      return find_april_grid(grey, board);
  }
  return FoundBoard();
}

}  // namespace waymark
