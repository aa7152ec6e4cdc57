#include "waymark/app/calibrate_camera/calibration_target.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/families/family.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

/// The tags on a board as drawn by `waymark tags board style=separate`, numbered row by row from the lower
/// left. The origin is at the centre, with x pointing right and y down.
TagMap tag_board(const TargetOptions& board) {
  const double pitch_m = board.tag_size_m * (1 + board.spacing);
  TagMap tags;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const double x_m = pitch_m * (column - 0.5 * (board.columns - 1));
      const double y_m = -pitch_m * (row - 0.5 * (board.rows - 1));
      tags.tags.emplace(TagId{FamilyId::Tag36h11, board.first_id + row * board.columns + column},
                        MappedTag{.map_T_tag = SE3(SO3(), {x_m, y_m, 0}), .size_m = board.tag_size_m});
    }
  }
  return tags;
}

Result<TagMap> tag_target(const TargetOptions& options) {
  const bool board = options.columns > 0 || options.rows > 0 || options.tag_size_m != 0;
  if (board != options.map.empty())
    return fail(ErrorCode::InvalidArgument,
                "give either a board (`cols`, `rows`, `tag_size_m`) or a tag map (`map`)");
  if (!options.map.empty())
    return or_wrong_kind(read_map(map_file_of(options.map)), options.map, FileUse::OwnMap)
        .map([](const MapFile& map) { return map.tags; });
  if (options.columns < 1 || options.rows < 1 || !is_tag_size(options.tag_size_m))
    return fail(ErrorCode::InvalidArgument,
                "a board needs `cols` and `rows` of at least 1 and a positive `tag_size_m`", {},
                "Measure the black square of a printed tag.");
  if (Status possible = check_printed_size(options.tag_size_m, "tag_size_m"); !possible)
    return tl::unexpected(possible.error());
  const auto ids = static_cast<std::int64_t>(family(FamilyId::Tag36h11).codes.size());
  const std::int64_t last = options.first_id + static_cast<std::int64_t>(options.columns) * options.rows - 1;
  if (options.first_id < 0 || last >= ids)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the board needs tags {} to {}, but the family has only tags 0 to {}",
                            options.first_id, last, ids - 1),
                {}, "Check `cols`, `rows` and `first_id`.");
  return tag_board(options);
}

constexpr const char* kTags = "apriltag_36h11";

/// Whether one dictionary ("4x4_100", "DICT_4X4_100") contains the markers of another ("4x4_50").
bool contains_dictionary(std::string dictionary, const std::string& other) {
  std::ranges::transform(dictionary, dictionary.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr std::string_view kPrefix = "dict_";
  if (dictionary.starts_with(kPrefix)) dictionary.erase(0, kPrefix.size());
  const std::size_t width = other.find('_');
  if (dictionary.substr(0, width) != other.substr(0, width)) return false;
  return dictionary.size() > other.size() || (dictionary.size() == other.size() && dictionary >= other);
}

class NoTags final : public Detector {
 public:
  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& /*image*/) const override {
    return std::vector<TagDetection>();
  }
};

}  // namespace

TagFinder no_tags() { return {.detector = std::make_unique<NoTags>()}; }

Result<std::optional<CalibrationBoard>> board_of(const TargetOptions& options) {
  const auto kind = board_kind(options.kind);
  if (!kind) return std::optional<CalibrationBoard>();
  const CalibrationBoard board{
      .kind = *kind,
      .columns = options.columns,
      .rows = options.rows,
      .size_m = *kind == BoardKind::AprilGrid ? options.tag_size_m : options.square_size_m,
      .marker_m = options.marker_size_m,
      .spacing = options.spacing,
      .first_id = options.first_id,
      .dictionary = options.dictionary,
      .legacy_pattern = options.legacy_pattern};
  if (Status usable = check_board(board); !usable) return tl::unexpected(usable.error());
  return std::optional(board);
}

Result<CalibrationTarget> CalibrationTarget::make(const TargetOptions& options) {
  CalibrationTarget target;
  target.options_ = options;
  auto board = board_of(options);
  if (!board) return tl::unexpected(board.error());
  if (!*board) {
    auto tags = tag_target(options);
    if (!tags) return tl::unexpected(tags.error());
    target.tags_ = *std::move(tags);
    return target;
  }
  auto finder = BoardFinder::load();
  if (!finder) return tl::unexpected(finder.error());
  target.finder_ = *std::move(finder);
  target.board_ = *std::move(board);
  target.places_m_ = board_corners(*target.board_);
  // Report an unknown dictionary before any image is read.
  if (const auto tried = target.finder_->find(Image(64, 64, 255), *target.board_); !tried)
    return tl::unexpected(tried.error());
  return target;
}

Result<SeenTarget> CalibrationTarget::find(const ImageView& image, const TagFinder& finder) const {
  if (board_) {
    const auto seen = finder_->find(image, *board_);
    if (!seen) return tl::unexpected(seen.error());
    return SeenTarget{.marks = target_marks(seen->corners, places_m_), .marker_share = seen->marker_share};
  }
  const auto found = find_tags(image, finder, ImageLens::unknown());
  if (!found) return tl::unexpected(found.error());
  return SeenTarget{.marks = target_marks(found->detections, tags_)};
}

std::string CalibrationTarget::absence_advice(const ImageView& image) const {
  const std::string& kind = options_.kind;
  const std::string general = fmt::format(
      "Check {}`target`, `cols` and `rows`. Make sure that the whole board is in view and in focus, and has "
      "a white margin.",
      kind == "charuco" ? "`dictionary`, " : "");
  const auto finder = finder_ ? Result<BoardFinder>(*finder_) : BoardFinder::load();
  const auto seen = finder ? finder->name_markers(image) : Result<std::string>("");
  if (!seen || seen->empty()) return general;
  if (*seen == "aprilgrid")
    return kind == "aprilgrid"
               ? general
               : "The image shows 36h11 tags with a border of two cells: set `target=aprilgrid`.";
  if (kind == "charuco" && contains_dictionary(options_.dictionary, *seen))
    return "The image shows the markers, but no corners at the positions predicted from `cols`, `rows`, "
           "`first_id`, `square_size_m` and `marker_size_m`. Check these values.";
  if (kind == "tags" && *seen == kTags) return general;
  if (*seen == kTags && kind != "charuco") return "The image shows 36h11 tags: set `target=tags`.";
  return fmt::format("The image shows markers of dictionary {0}: set {1}`dictionary={0}`.", *seen,
                     kind == "charuco" ? "" : "`target=charuco` and ");
}

std::optional<std::string> CalibrationTarget::marker_size_warning(std::vector<double> shares) const {
  constexpr double kTolerance = 0.05;  // blur alone changes the apparent size of small markers by 1 to 2 %
  if (!board_ || board_->kind != BoardKind::Charuco || shares.empty()) return std::nullopt;
  const double share = median(std::move(shares));
  const double given = board_->marker_m / board_->size_m;
  if (std::abs(share / given - 1) < kTolerance) return std::nullopt;
  return fmt::format(
      "The observed ratio of marker to square size is {:.2f}, but `marker_size_m={:g}` and "
      "`square_size_m={:g}` imply {:.2f}. Measure both again.",
      share, board_->marker_m, board_->size_m, given);
}

void refuse_of_other_targets(const TargetOptions& options, FieldRefusals& refused) {
  struct TargetField {
    const char* name;
    std::vector<std::string> kinds;
  };
  const std::vector<TargetField> fields = {{"tag_size_m", {"tags", "aprilgrid"}},
                                           {"spacing", {"tags", "aprilgrid"}},
                                           {"square_size_m", {"chessboard", "charuco"}},
                                           {"marker_size_m", {"charuco"}},
                                           {"dictionary", {"charuco"}},
                                           {"legacy_pattern", {"charuco"}},
                                           {"first_id", {"tags", "aprilgrid", "charuco"}},
                                           {"detections", {"tags"}}};
  for (const TargetField& field : fields)
    refused.fields(std::ranges::find(field.kinds, options.kind) == field.kinds.end(), {field.name},
                   fmt::format("this option has no effect on target {}", options.kind),
                   fmt::format("Omit this option, or set `target={}`.", fmt::join(field.kinds, " or ")));
}

}  // namespace waymark
