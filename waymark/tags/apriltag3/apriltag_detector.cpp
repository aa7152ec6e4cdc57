#include "waymark/tags/apriltag3/apriltag_detector.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <utility>

#include <apriltag/apriltag.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/families/apriltag_family.hpp"

namespace waymark {
namespace {

struct LoadedFamily {
  FamilyId id = FamilyId::Tag36h11;
  AprilTagFamily table;
};

struct DestroyWorkspace {
  void operator()(apriltag_detector_t* workspace) const { apriltag_detector_destroy(workspace); }
};
using Workspace = std::unique_ptr<apriltag_detector_t, DestroyWorkspace>;

struct DestroyDetections {
  void operator()(zarray_t* detections) const { apriltag_detections_destroy(detections); }
};
using Detections = std::unique_ptr<zarray_t, DestroyDetections>;

/// libapriltag sets errno even on success; this must not be visible to callers.
class KeepErrno {
 public:
  KeepErrno() = default;
  KeepErrno(const KeepErrno&) = delete;
  KeepErrno& operator=(const KeepErrno&) = delete;
  ~KeepErrno() { errno = saved_; }

 private:
  int saved_ = errno;
};

int decimated_side(int side_px, double factor) {
  if (factor == 1.5) return side_px / 3 * 2;
  return 1 + (side_px - 1) / static_cast<int>(factor);
}

/// The odd width of the blur kernel, computed as in libapriltag.
int blur_width(double sigma) { return static_cast<int>(4 * sigma) | 1; }

/// libapriltag 3.3 reads out of bounds if an image has less than 4 pixels per side after decimation, and
/// divides by zero for some other sizes. It writes out of bounds if an image is narrower than the blur
/// kernel. The narrowest tag is 8 cells wide including its margin.
bool can_hold_a_tag(const ImageView& image, const DetectorOptions& options) {
  constexpr int kNarrowest = 8;
  const int least = std::max(kNarrowest, blur_width(options.quad_sigma) + 1);
  return !image.empty() && decimated_side(image.width, options.quad_decimate) >= least &&
         decimated_side(image.height, options.quad_decimate) >= least;
}

class AprilTagDetector final : public Detector {
 public:
  AprilTagDetector(DetectorOptions options, std::vector<LoadedFamily> families)
      : options_(std::move(options)), families_(std::move(families)) {
    idle_.push_back(new_workspace());
  }
  ~AprilTagDetector() override = default;
  AprilTagDetector(const AprilTagDetector&) = delete;
  AprilTagDetector& operator=(const AprilTagDetector&) = delete;

  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image) const override;

  [[nodiscard]] bool has_tables() const {
    return std::all_of(families_.begin(), families_.end(),
                       [](const auto& f) { return f.table->impl != nullptr; });
  }

 private:
  /// The threshold is computed for tiles of 4 pixels in the decimated image.
  [[nodiscard]] int region_alignment_px() const override {
    return static_cast<int>(4 * options_.quad_decimate);
  }

  [[nodiscard]] Workspace new_workspace() const;
  [[nodiscard]] Workspace take_workspace() const;
  [[nodiscard]] Result<std::vector<TagDetection>> detect_with(apriltag_detector_t& workspace,
                                                              const ImageView& image) const;
  [[nodiscard]] TagDetection converted(const apriltag_detection_t& raw) const;

  DetectorOptions options_;
  /// The workspaces share the decoding tables, which are read-only once the first workspace has been created.
  std::vector<LoadedFamily> families_;
  mutable std::mutex mutex_;
  mutable std::vector<Workspace> idle_;  ///< guarded by mutex_
};

Workspace AprilTagDetector::new_workspace() const {
  Workspace workspace(apriltag_detector_create());
  // Starting worker threads involves a race that can crash the process (see README.md in this room).
  workspace->nthreads = 1;
  workspace->quad_decimate = static_cast<float>(options_.quad_decimate);
  workspace->quad_sigma = static_cast<float>(options_.quad_sigma);
  workspace->refine_edges = options_.refine_edges;
  workspace->decode_sharpening = options_.decode_sharpening;
  workspace->debug = false;  // debug mode writes files to the working directory
  workspace->qtp.min_white_black_diff = options_.min_white_black_diff;
  for (const LoadedFamily& family : families_) {
    apriltag_detector_add_family_bits(workspace.get(), family.table.get(), options_.max_hamming);
  }
  return workspace;
}

Workspace AprilTagDetector::take_workspace() const {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      Workspace workspace = std::move(idle_.back());
      idle_.pop_back();
      return workspace;
    }
  }
  return new_workspace();
}

TagDetection AprilTagDetector::converted(const apriltag_detection_t& raw) const {
  TagDetection detection;
  for (const LoadedFamily& family : families_) {
    if (family.table.get() == raw.family) detection.tag = {family.id, raw.id};
  }
  detection.hamming = raw.hamming;
  detection.decision_margin = raw.decision_margin;
  for (std::size_t i = 0; i < 4; ++i) detection.corners_px[i] = {raw.p[3 - i][0], raw.p[3 - i][1]};
  return detection;
}

Result<std::vector<TagDetection>> AprilTagDetector::detect(const ImageView& image) const {
  constexpr int kMaxSide = 32767;
  if (!image.empty() && image.stride < image.width) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("image rows of {} px with a stride of {} bytes", image.width, image.stride), {},
                "Set `stride` to at least the width.");
  }
  if (!can_hold_a_tag(image, options_)) return std::vector<TagDetection>();
  if (image.width > kMaxSide || image.height > kMaxSide ||
      std::int64_t{image.width} * image.height > kMaxImagePixels) {
    return fail(
        ErrorCode::LimitExceeded, fmt::format("image of {} x {} px is too large", image.width, image.height),
        {},
        fmt::format("Crop or scale it to at most {} pixels and {} px per side.", kMaxImagePixels, kMaxSide));
  }
  const KeepErrno keep_errno;
  Workspace workspace = take_workspace();
  Result<std::vector<TagDetection>> found = detect_with(*workspace, image);
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(workspace));
  return found;
}

Result<std::vector<TagDetection>> AprilTagDetector::detect_with(apriltag_detector_t& workspace,
                                                                const ImageView& image) const {
  ImageView source = image;
  std::vector<std::uint8_t> copy;
  if (options_.quad_sigma > 0 && options_.quad_decimate <= 1) {  // libapriltag blurs its input in this case
    copy.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y) copy.insert(copy.end(), image.row(y), image.row(y) + image.width);
    source = {copy.data(), image.width, image.height, image.width};
  }
  // The struct is const except for its pixels, and these are only read.
  auto* pixels = const_cast<std::uint8_t*>(source.data);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  image_u8_t wrapped{source.width, source.height, source.stride, pixels};
  const Detections raw(apriltag_detector_detect(&workspace, &wrapped));
  std::vector<TagDetection> detections;
  for (int i = 0; i < zarray_size(raw.get()); ++i) {
    const apriltag_detection_t* one = nullptr;
    zarray_get(raw.get(), i, &one);
    TagDetection detection = converted(*one);
    const bool finite = std::all_of(detection.corners_px.begin(), detection.corners_px.end(),
                                    [](const Eigen::Vector2d& corner) { return corner.allFinite(); });
    // The comparison is also false if the margin is NaN.
    if (finite && detection.decision_margin >= options_.min_decision_margin) detections.push_back(detection);
  }
  sort_detections(detections);
  return detections;
}

Status check_decimation(double factor) {
  const bool known = factor == 1.5 || factor == std::floor(factor);
  if (known) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("cannot decimate by {}", factor),
              {.key = "quad_decimate"}, "Use 1, 1.5 or an integer up to 8.");
}

Status check_library_options(const DetectorOptions& options) {
  if (!options.find_inverted) return {};
  return fail(ErrorCode::InvalidArgument, "AprilTag 3 does not detect inverted tags",
              {.key = "find_inverted"}, "Use the detector waymark.");
}

Status check_memory(const std::vector<FamilyId>& ids, const DetectorOptions& options) {
  constexpr std::int64_t kMiB = 1 << 20;
  std::int64_t bytes = 0;
  for (const FamilyId id : ids) bytes += decode_table_bytes(family(id), options.max_hamming);
  const std::int64_t needed_mib = (bytes + kMiB - 1) / kMiB;
  if (needed_mib <= options.memory_limit_mib) return {};
  return fail(
      ErrorCode::LimitExceeded,
      fmt::format("correcting {} bits of {} needs {} MiB of decoding tables, more than the limit of {} MiB",
                  options.max_hamming, fmt::join(options.families, ", "), needed_mib,
                  options.memory_limit_mib),
      {.key = "max_hamming"}, "Lower `max_hamming`, use fewer families or raise `memory_limit_mib`.");
}

}  // namespace

std::int64_t decode_table_bytes(const Family& family, int max_hamming) {
  constexpr std::int64_t kEntryBytes = 16;
  constexpr std::int64_t kSlotsPerCode = 3;  // slots per code in the hash table
  const auto bits = static_cast<std::int64_t>(family.bits.size());
  std::int64_t codes = 1;
  if (max_hamming >= 1) codes += bits;
  if (max_hamming >= 2) codes += bits * (bits - 1);  // libapriltag allocates twice the space needed for pairs
  return static_cast<std::int64_t>(family.codes.size()) * codes * kSlotsPerCode * kEntryBytes;
}

Result<std::unique_ptr<Detector>> make_apriltag_detector(const DetectorOptions& options) {
  if (const Status ranges = check_ranges(options); !ranges) return tl::unexpected<Error>(ranges.error());
  if (const Status ours = check_library_options(options); !ours) return tl::unexpected<Error>(ours.error());
  if (const Status known = check_decimation(options.quad_decimate); !known)
    return tl::unexpected<Error>(known.error());
  const Result<std::vector<FamilyId>> ids = chosen_families(options);
  if (!ids) return tl::unexpected<Error>(ids.error());
  if (const Status fits = check_memory(*ids, options); !fits) return tl::unexpected<Error>(fits.error());

  const KeepErrno keep_errno;
  std::vector<LoadedFamily> families;
  for (const FamilyId id : *ids) families.push_back({id, make_apriltag_family(id)});
  auto detector = std::make_unique<AprilTagDetector>(options, std::move(families));
  if (!detector->has_tables()) {
    return fail(ErrorCode::LimitExceeded, "not enough memory for the decoding tables", {.key = "families"},
                "Lower `max_hamming` or use fewer families.");
  }
  return detector;
}

}  // namespace waymark
