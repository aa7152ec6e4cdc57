#include "waymark/drivers/simulated/scene_eye.hpp"

#include <utility>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/tags/refining_detector.hpp"

namespace waymark {
namespace {

/// The detector of these options, for the families that the world has.
Result<std::unique_ptr<Detector>> make_detector(const World& world, const CameraModel& camera,
                                                SceneEyeOptions options) {
  options.detector.families = {std::string(family(world.anchor.family).name)};
  auto detector = make_apriltag_detector(options.detector);
  if (!detector || !options.refine_corners) return detector;
  return make_refining_detector(std::move(*detector), options.refinement, camera);
}

}  // namespace

SceneEye::SceneEye(SceneCamera camera, std::unique_ptr<Detector> detector, const SE3& base_T_cam,
                   const SceneEyeOptions& options, std::shared_ptr<const World> world)
    : camera_(std::move(camera)),
      detector_(std::move(detector)),
      base_T_cam_(base_T_cam),
      options_(options),
      world_(std::move(world)) {}

Result<std::unique_ptr<SceneEye>> SceneEye::make(std::shared_ptr<const World> world,
                                                 const CameraModel& camera, const SE3& base_T_cam,
                                                 const SceneEyeOptions& options) {
  auto scene_camera = SceneCamera::make(scene_of(*world, options.scene), camera, options.camera);
  if (!scene_camera) return tl::unexpected(scene_camera.error());
  auto detector = make_detector(*world, camera, options);
  if (!detector) return tl::unexpected(detector.error());
  return std::unique_ptr<SceneEye>(
      new SceneEye(std::move(*scene_camera), std::move(*detector), base_T_cam, options, std::move(world)));
}

Result<std::unique_ptr<SceneEye>> SceneEye::another() const {
  auto detector = make_detector(*world_, camera_.model(), options_);
  if (!detector) return tl::unexpected(detector.error());
  return std::unique_ptr<SceneEye>(
      new SceneEye(camera_, std::move(*detector), base_T_cam_, options_, world_));
}

Status SceneEye::face(const std::shared_ptr<const World>& world) {
  if (world == world_) return {};
  world_ = world;
  return camera_.set_scene(scene_of(*world, options_.scene));
}

Status SceneEye::through_jpeg(Image& image) const {
  if (options_.camera.jpeg_quality == 0) return {};
  const auto bytes = encode_jpeg(image, options_.camera.jpeg_quality);
  if (!bytes) return tl::unexpected(bytes.error());
  auto decoded = decode_image(*bytes, "rendered");
  if (!decoded) return tl::unexpected(decoded.error());
  image = std::move(*decoded);
  return {};
}

Result<RenderedFrame> SceneEye::take(const CameraShot& shot) {
  if (Status status = face(shot.world); !status) return tl::unexpected(status.error());
  // Over the time of one picture the velocity is the same.
  const SE3 base_T_cam = base_T_cam_;
  const auto motion = [&](double seconds) {
    return shot.map_T_base * lift(SE2::exp(shot.twist * seconds)) * base_T_cam;
  };
  auto picture = camera_.render(motion, shot.stamp, shot.seed);
  if (!picture) return picture;
  if (shot.dark) {
    picture->image = Image(picture->image.width(), picture->image.height());
    picture->tags.clear();
  }
  if (Status status = through_jpeg(picture->image); !status) return tl::unexpected(status.error());
  return picture;
}

Result<SeenPicture> SceneEye::look(const CameraShot& shot) {
  auto picture = take(shot);
  if (!picture) return tl::unexpected(picture.error());
  auto found = detector_->detect(picture->image);
  if (!found) return tl::unexpected(found.error());
  SeenPicture seen{.picture = std::move(*picture), .found = {.stamp = shot.stamp}};
  seen.found.detections = std::move(*found);
  return seen;
}

}  // namespace waymark
