#include "waymark/robots/simulated/detecting_camera.hpp"

#include <utility>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// The tag finder from the options, for the tag family used in the world.
Result<TagFinder> make_finder(const World& world, DetectingCameraOptions options) {
  options.detector.families = {std::string(family(world.anchor.family).name)};
  auto finder = make_tag_finder(options.detector, options.refinement);
  if (finder && !options.refine_corners) finder->refinement.reset();
  return finder;
}

}  // namespace

DetectingCamera::DetectingCamera(std::vector<MountedSceneCamera> cameras, TagFinder finder,
                                 const DetectingCameraOptions& options, std::shared_ptr<const World> world)
    : cameras_(std::move(cameras)), finder_(std::move(finder)), options_(options), world_(std::move(world)) {}

Result<std::unique_ptr<DetectingCamera>> DetectingCamera::make(std::shared_ptr<const World> world,
                                                               const std::vector<MountedCamera>& cameras,
                                                               const DetectingCameraOptions& options) {
  std::vector<MountedSceneCamera> all;
  for (const MountedCamera& mounted : cameras) {
    auto camera = SceneCamera::make(scene_of(*world, options.scene), mounted.camera, options.camera);
    if (!camera) return tl::unexpected(camera.error());
    all.push_back({mounted, std::move(*camera)});
  }
  auto finder = make_finder(*world, options);
  if (!finder) return tl::unexpected(finder.error());
  return std::unique_ptr<DetectingCamera>(
      new DetectingCamera(std::move(all), std::move(*finder), options, std::move(world)));
}

Result<std::unique_ptr<DetectingCamera>> DetectingCamera::another() const {
  auto finder = make_finder(*world_, options_);
  if (!finder) return tl::unexpected(finder.error());
  return std::unique_ptr<DetectingCamera>(
      new DetectingCamera(cameras_, std::move(*finder), options_, world_));
}

Status DetectingCamera::set_world(const std::shared_ptr<const World>& world) {
  if (world == world_) return {};
  world_ = world;
  for (MountedSceneCamera& each : cameras_) {
    if (Status status = each.camera.set_scene(scene_of(*world, options_.scene)); !status) return status;
  }
  return {};
}

Status DetectingCamera::through_jpeg(Image& image) const {
  if (options_.camera.jpeg_quality == 0) return {};
  const auto bytes = encode_jpeg(image, options_.camera.jpeg_quality);
  if (!bytes) return tl::unexpected(bytes.error());
  auto decoded = decode_image(*bytes, "rendered");
  if (!decoded) return tl::unexpected(decoded.error());
  image = std::move(*decoded);
  return {};
}

Result<RenderedFrame> DetectingCamera::take(const CameraShot& shot) {
  if (Status status = set_world(shot.world); !status) return tl::unexpected(status.error());
  // The velocity is constant during the exposure and readout of an image.
  MountedSceneCamera& scene_camera = cameras_.at(shot.camera);
  const SE3 base_T_cam = scene_camera.mounted.base_T_cam;
  const auto motion = [&](double seconds) {
    return shot.map_T_base * lift(SE2::exp(shot.twist * seconds)) * base_T_cam;
  };
  auto frame = scene_camera.camera.render(motion, shot.stamp, shot.seed);
  if (!frame) return frame;
  if (shot.dark) {
    frame->image = Image(frame->image.width(), frame->image.height());
    frame->tags.clear();
  }
  if (Status status = through_jpeg(frame->image); !status) return tl::unexpected(status.error());
  return frame;
}

Result<SeenImage> DetectingCamera::detect(const CameraShot& shot) {
  auto frame = take(shot);
  if (!frame) return tl::unexpected(frame.error());
  const MountedCamera& mounted = cameras_.at(shot.camera).mounted;
  auto found = find_tags(frame->image, finder_, ImageLens::of(mounted.camera));
  if (!found) return tl::unexpected(found.error());
  SeenImage seen{.frame = std::move(*frame), .found = {.stamp = shot.stamp, .camera = mounted.name}};
  seen.found.detections = std::move(found->detections);
  return seen;
}

}  // namespace waymark
