#include "waymark/tags/refining_detector.hpp"

#include <utility>
#include <vector>

namespace waymark {
namespace {

class RefiningDetector final : public Detector {
 public:
  RefiningDetector(std::unique_ptr<Detector> detector, const RefinementOptions& options,
                   std::optional<CameraModel> camera)
      : detector_(std::move(detector)), options_(options), camera_(std::move(camera)) {}

  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image) const override {
    return refine_all(image, detector_->detect(image));
  }

  // Not on the regions one by one: the camera knows pixels of the whole image.
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image,
                                                         std::span<const PixelRect> regions) const override {
    return refine_all(image, detector_->detect(image, regions));
  }

 private:
  [[nodiscard]] Result<std::vector<TagDetection>> refine_all(const ImageView& image,
                                                             Result<std::vector<TagDetection>> found) const {
    if (!found) return found;
    for (TagDetection& detection : *found) {
      detection = refined(image, std::move(detection), options_, camera_ ? &*camera_ : nullptr);
    }
    sort_detections(*found);
    return found;
  }

  std::unique_ptr<Detector> detector_;
  RefinementOptions options_;
  std::optional<CameraModel> camera_;
};

}  // namespace

Result<std::unique_ptr<Detector>> make_refining_detector(std::unique_ptr<Detector> detector,
                                                         const RefinementOptions& options,
                                                         std::optional<CameraModel> camera) {
  if (detector == nullptr) {
    return fail(ErrorCode::InvalidArgument, "no detector to refine the corners of", {},
                "Make a detector first.");
  }
  if (const Status status = check_ranges(options); !status) return tl::unexpected<Error>(status.error());
  return std::make_unique<RefiningDetector>(std::move(detector), options, std::move(camera));
}

TagDetection refined(const ImageView& image, TagDetection detection, const RefinementOptions& options,
                     const CameraModel* camera) {
  const RefinedCorners corners = refine_corners(image, detection, options, camera);
  detection.corners_px = corners.corners_px;
  detection.corner_covariance_px2 = corners.covariance_px2;
  return detection;
}

}  // namespace waymark
