#include "waymark/media/opencv/find_board.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "waymark/base/order_statistics.hpp"
#include "waymark/media/opencv/marker_dictionary.hpp"

namespace waymark {
namespace {

constexpr double kHalfPixel = 0.5;  // OpenCV counts from the centres of pixels

cv::Mat as_mat(const ImageView& image) {
  // OpenCV has no type for pixels that are only read.
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

BoardCorner corner_at(int number, const cv::Point2f& point) {
  return {.number = number, .px = {point.x + kHalfPixel, point.y + kHalfPixel}};
}

/// A rough search on a smaller picture first: where there is no chessboard, the careful one takes long.
bool may_show_chessboard(const cv::Mat& grey, const cv::Size& inner) {
  constexpr int kSmallSide = 640;
  const double scale = static_cast<double>(kSmallSide) / std::max(grey.cols, grey.rows);
  cv::Mat small = grey;
  if (scale < 1) cv::resize(grey, small, {}, scale, scale, cv::INTER_AREA);
  return cv::checkChessboard(small, inner) || cv::checkChessboard(grey, inner);
}

/// The markers of a board in a picture, by number; those seen twice are left out.
using SeenMarkers = std::map<int, std::vector<cv::Point2f>>;

Result<SeenMarkers> find_markers(const cv::Mat& grey, const std::string& name, int border_cells,
                                 int markers_needed) {
  const auto dictionary = marker_dictionary(name);
  if (!dictionary) return tl::unexpected(dictionary.error());
  if (markers_needed > (*dictionary)->bytesList.rows)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the board has the markers up to {}, the dictionary {} only {}",
                            markers_needed - 1, name, (*dictionary)->bytesList.rows),
                {.key = "dictionary"}, "Take a larger dictionary.");
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

/// A corner to be refined, and how far around it there is nothing else.
struct Guess {
  int number = 0;
  cv::Point2f at{};
  double free_px = 0;
};

/// Refines each corner within its free surroundings; those that leave them are none.
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
    // OpenCV puts a corner that ran away back to where it began, exactly.
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
  // What it finds is up to a third of a pixel off where the board leans; the saddle itself is nearer.
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

/// The corner at `corner_m` as the marker foretells it, a projective image of its square.
cv::Point2f foretold(const BoardMarker& marker, const std::vector<cv::Point2f>& seen,
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

/// A corner between two markers, from those of the two that are seen. Nothing where they contradict each
/// other.
std::optional<Guess> guess_between(int number, const Eigen::Vector2d& corner_m, const CalibrationBoard& board,
                                   const std::vector<BoardMarker>& markers, const SeenMarkers& seen) {
  std::vector<cv::Point2f> guesses;
  double free_px = 1e9;
  for (const BoardMarker& marker : markers) {
    const auto found = seen.find(marker.id);
    if (found == seen.end() || (marker.middle_m - corner_m).norm() > board.size_m) continue;
    guesses.push_back(foretold(marker, found->second, corner_m));
    for (const cv::Point2f& point : found->second)
      free_px = std::min(free_px, distance_px(point, guesses.back()));
  }
  if (guesses.empty()) return std::nullopt;
  const cv::Point2f at = 0.5F * (guesses.front() + guesses.back());
  if (distance_px(guesses.front(), guesses.back()) > free_px) return std::nullopt;
  return Guess{number, at, free_px};
}

/// The sides of a marker over those of its square, by the projective image of the square. The detector's
/// corners lie within the marker where edges are wide: they are refined.
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

/// Of the markers whose squares have all four corners, the median; nothing where there are few.
std::optional<double> share_of_squares(const cv::Mat& grey, const CalibrationBoard& board,
                                       const SeenMarkers& seen, const std::vector<BoardCorner>& corners) {
  constexpr std::size_t kFewest = 4;
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
    const int first = (row - 1) * inner + column - 1;  // the corner of the square at its upper left
    const std::array<int, 4> around = {first, first + 1, first + inner + 1, first + inner};
    const auto found = seen.find(marker.id);
    const bool within = column > 0 && row > 0 && column < inner && row + 1 < board.rows;
    if (!within || found == seen.end() ||
        !std::ranges::all_of(around, [&](int number) { return at.contains(number); }))
      continue;
    shares.push_back(
        share_of_square(grey, {at[around[0]], at[around[1]], at[around[2]], at[around[3]]}, found->second));
  }
  if (shares.size() < kFewest) return std::nullopt;
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

/// Corners of the tags of an AprilGrid, each the corner of a black square as well. OpenCV's tags of this
/// family are turned by half: it begins with the lower right corner.
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
