#include "waymark/recording/recording_setup.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/raw_pixels.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/transform_odometry.hpp"

namespace waymark {
namespace {

struct HeaderFirst {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};
struct ImageHead {
  ros2::Header header{};
  std::uint32_t height = 0, width = 0;
  std::string encoding{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.encoding)
};
struct OdometryHead {
  ros2::Header header{};
  std::string child_frame_id{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id)
};

template <class Items>
auto* with_topic(Items& items, std::string_view topic) {
  const auto known = std::ranges::find(items, topic, [](const auto& item) { return item.topic; });
  return known == items.end() ? nullptr : &*known;
}

/// Camera model of rectified images: the projection matrix, without distortion.
std::optional<CameraModel> rectified_camera(const ros2::CameraInfo& info) {
  if (!(info.p[0] > 0)) return std::nullopt;
  const Result<CameraModel> camera = ros2::rectified_from_ros(info);
  return camera ? std::optional(*camera) : std::nullopt;
}

/// Drivers of uncalibrated cameras publish zeros.
Result<CameraModel> camera_of(const ros2::CameraInfo& info) {
  if (!(info.k[0] > 0))
    return fail(ErrorCode::NotFound, "the camera is not calibrated: its focal length is zero", {},
                "Calibrate it with `waymark calibrate camera` and pass the robot file with `robot`.");
  return ros2::from_ros(info);
}

/// Binning and region of interest, for messages; empty if the whole image is sent.
std::string part_text(const ros2::CameraInfo& info) {
  std::string text;
  if (info.binning_x > 1 || info.binning_y > 1)
    text = fmt::format(", binning {}x{}", std::max(info.binning_x, 1U), std::max(info.binning_y, 1U));
  const ros2::RegionOfInterest& roi = info.roi;
  if (roi.width > 0 || roi.height > 0 || roi.x_offset > 0 || roi.y_offset > 0)
    text += fmt::format(", region {}x{} at ({}, {})", roi.width, roi.height, roi.x_offset, roi.y_offset);
  return text.empty() ? text : fmt::format(" ({}x{}{})", info.width, info.height, text);
}

Status add_info(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  RecordedCameraInfo* known = with_topic(facts.infos, topic);
  if (known != nullptr && known->camera) return {};
  const auto message = cdr::decode<ros2::CameraInfo>(cdr);
  if (!message) return tl::unexpected(message.error());
  if (known == nullptr) known = &facts.infos.emplace_back();
  known->topic = topic;
  known->frame = frame_name(message->header.frame_id);
  Result<CameraModel> camera = camera_of(*message);
  if (camera) {
    known->camera = *camera;
    known->rectified = rectified_camera(*message);
    known->part = part_text(*message);
    known->error.reset();
  } else {
    known->error = camera.error();
    known->error->place.key = topic;
  }
  return {};
}

Status add_transforms(CameraFacts& facts, ByteSpan cdr) {
  const auto message = cdr::decode<ros2::TFMessage>(cdr);
  if (!message) return tl::unexpected(message.error());
  for (const ros2::TransformStamped& transform : message->transforms) {
    facts.frames.add(transform.header.frame_id, transform.child_frame_id,
                     ros2::sound(transform) ? std::optional(ros2::from_ros(transform)) : std::nullopt);
  }
  return {};
}

Error on_topic(Error error, std::string_view topic) {
  error.place = {.key = std::string(topic)};
  return error;
}

Status add_image(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  const auto head = cdr::decode<ImageHead>(cdr);
  if (!head) return tl::unexpected(head.error());
  constexpr std::uint32_t kMaxSide = 1U << 20U;
  facts.views.push_back({std::string(topic), frame_name(head->header.frame_id), true, head->encoding,
                         static_cast<int>(std::min(head->width, kMaxSide)),
                         static_cast<int>(std::min(head->height, kMaxSide))});
  if (Status readable = check_raw_encoding(head->encoding); !readable)
    facts.views.back().error = on_topic(readable.error(), topic);
  return {};
}

/// The size of a compressed image is stored in its data.
Status add_compressed(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  const auto message = cdr::decode<ros2::CompressedImage>(cdr);
  if (!message) return tl::unexpected(message.error());
  RecordedView view{std::string(topic), frame_name(message->header.frame_id), true, {}};
  if (const Result<ImageInfo> info = probe(message->data, topic)) {
    view.width_px = info->width;
    view.height_px = info->height;
  } else {
    view.error = on_topic(info.error(), topic);
  }
  facts.views.push_back(std::move(view));
  return {};
}

Status add_tags(CameraFacts& facts, std::string_view topic, ByteSpan cdr) {
  const auto head = cdr::decode<HeaderFirst>(cdr);
  if (!head) return tl::unexpected(head.error());
  facts.views.push_back({std::string(topic), frame_name(head->header.frame_id), false, {}});
  return {};
}

bool is_tags(std::string_view type) {
  return type == ros2::AprilTagDetectionArray::kType || type == ros2::ApriltagArrayStamped::kType ||
         type == ros2::TagPoseArray::kType;
}

}  // namespace

bool first_message_has_facts(std::string_view type) {
  return is_tags(type) || type == ros2::Image::kType || type == ros2::CompressedImage::kType ||
         type == ros2::Odometry::kType || type == ros2::Imu::kType;
}

Status add_fact(CameraFacts& facts, std::string_view topic, std::string_view type, ByteSpan cdr) {
  if (type == ros2::CameraInfo::kType) return add_info(facts, topic, cdr);
  if (type == ros2::TFMessage::kType) return add_transforms(facts, cdr);
  if (with_topic(facts.views, topic) != nullptr || with_topic(facts.motions, topic) != nullptr) return {};
  if (type == ros2::Image::kType) return add_image(facts, topic, cdr);
  if (type == ros2::CompressedImage::kType) return add_compressed(facts, topic, cdr);
  if (is_tags(type)) return add_tags(facts, topic, cdr);
  if (type == ros2::Odometry::kType) {
    const auto head = cdr::decode<OdometryHead>(cdr);
    if (!head) return tl::unexpected(head.error());
    facts.motions.push_back({std::string(topic), frame_name(head->child_frame_id), false});
  }
  if (type == ros2::Imu::kType) {
    const auto head = cdr::decode<HeaderFirst>(cdr);
    if (!head) return tl::unexpected(head.error());
    facts.motions.push_back({std::string(topic), frame_name(head->header.frame_id), true});
  }
  return {};
}

namespace {

bool differ(const SE3& a, const SE3& b) {
  constexpr double kRounding = 1e-9;  // in m and rad
  return (a.inverse() * b).log().norm() > kRounding;
}

/// Whether transforms may be the odometry of the robot: they lead to its base.
bool leads_to_base(const RecordedMotion& motion, const CameraChoice& choice) {
  return !motion.parent.empty() &&
         (motion.frame == frame_name(choice.base_frame) || ros2::is_usual_base(motion.frame));
}

}  // namespace

Status add_odometry_frames(CameraFacts& facts, std::string_view topic, std::string_view /*type*/,
                           ByteSpan cdr) {
  const auto message = cdr::decode<ros2::TFMessage>(cdr);
  if (!message) return tl::unexpected(message.error());
  for (const ros2::TransformStamped& transform : message->transforms) {
    if (!ros2::is_odometry_frame(transform.header.frame_id) || !ros2::sound(transform)) continue;
    const RecordedMotion now{std::string(topic), frame_name(transform.child_frame_id), false,
                             frame_name(transform.header.frame_id), ros2::from_ros(transform)};
    const auto known = std::ranges::find_if(
        facts.motions, [&](const RecordedMotion& m) { return !m.imu && m.link() == now.link(); });
    if (known == facts.motions.end())
      facts.motions.push_back(now);
    else if (known->only_pose && differ(*known->only_pose, *now.only_pose))
      known->only_pose.reset();
  }
  return {};
}

bool all_moved(const CameraFacts& facts, const CameraChoice& choice) {
  bool any = false;
  for (const RecordedMotion& motion : facts.motions) {
    if (!leads_to_base(motion, choice)) continue;
    if (motion.only_pose) return false;
    any = true;
  }
  return any;
}

namespace {

constexpr std::string_view kOptical = "optical";

/// Turns "/cam/image_raw/compressed", the compressed form, into "/cam/image_raw".
std::string unpacked_topic(std::string topic) {
  constexpr std::string_view kPacked = "/compressed";
  if (topic.ends_with(kPacked)) topic.resize(topic.size() - kPacked.size());
  return topic;
}

/// The part before the last slash, which is the namespace that an image topic shares with its calibration.
std::string namespace_of(const std::string& topic) {
  const std::string plain = unpacked_topic(topic);
  return plain.substr(0, std::min(plain.rfind('/'), plain.size()));
}

bool is_rectified(const std::string& topic) {
  return unpacked_topic(topic).substr(namespace_of(topic).size()).find("rect") != std::string::npos;
}

/// Whether the frame is called `name` in any namespace, for example base_link.
bool is_named(const std::string& frame, std::string_view name) {
  return frame == name || frame.ends_with("/" + std::string(name));
}

bool is_on_topic(const std::string& topic, const std::string& place) {
  const std::string root = place.ends_with('/') ? place.substr(0, place.size() - 1) : place;
  return topic == root || topic.starts_with(root + "/");
}

/// A link as text: "/tf (odom to base_link)".
std::string words_of(const OdometryFrames& link) {
  return fmt::format("{} ({} to {})", link.topic, link.parent, link.child);
}

std::string odometry_note(const ChosenCamera& chosen) {
  return fmt::format(
      "odometry is read from the transforms on {}, because the recording contains no nav_msgs/Odometry",
      chosen.odometry);
}

class CameraSelector {
 public:
  CameraSelector(const CameraFacts& facts, const CameraChoice& choice) : facts_(facts), choice_(choice) {}

  ChosenCamera run() {
    choose_views();
    choose_info();
    choose_motion(false, choice_.odometry_topic, "odom", "odometry_topic");
    if (odometry_ == nullptr) choose_transforms();
    choose_motion(true, choice_.imu_topic, "imu", "imu_topic");
    find_mounting();
    turn_imu();
    return std::move(chosen_);
  }

 private:
  void choose_views();
  void keep_one_copy();
  void choose_info();
  void check_size(const RecordedCameraInfo& info);
  void choose_motion(bool imu, const std::string& requested, std::string_view usual, const char* field);
  std::vector<const RecordedMotion*> moving_transforms();
  void choose_transforms();
  void use_transforms(const RecordedMotion& motion);
  void note_several(const std::vector<const RecordedMotion*>& all);
  void find_mounting();
  std::string find_base(const std::string& camera);
  [[nodiscard]] std::string find_camera() const;
  void turn_imu();
  void note(std::string words) { chosen_.notes.push_back(std::move(words)); }
  void ambiguous(std::string words, std::string hint) {
    if (!chosen_.ambiguous)
      chosen_.ambiguous = Error{ErrorCode::InvalidArgument, std::move(words), {}, std::move(hint)};
  }

  const CameraFacts& facts_;
  const CameraChoice& choice_;
  ChosenCamera chosen_;
  std::vector<RecordedView> views_;  ///< views of the chosen camera
  const RecordedMotion* odometry_ = nullptr;
  const RecordedMotion* imu_ = nullptr;
};

void CameraSelector::choose_views() {
  std::vector<RecordedView> all;
  for (const RecordedView& view : facts_.views) {
    if (shows_distances(view)) {
      chosen_.unused.insert(view.topic);
      note(fmt::format("depth images of {} are ignored", view.topic));
    } else {
      all.push_back(view);
    }
  }
  const auto choose = [&](const std::string& requested, auto takes) {
    if (requested.empty() || std::ranges::none_of(all, takes)) return false;
    std::vector<RecordedView> kept;
    for (const RecordedView& view : all) {
      if (takes(view)) {
        kept.push_back(view);
      } else {
        chosen_.unused.insert(view.topic);
      }
    }
    all = std::move(kept);
    return true;
  };
  if (!choice_.camera_topic.empty()) {
    const auto names = [&](const auto& item) { return is_on_topic(item.topic, choice_.camera_topic); };
    const auto shares = [&](const RecordedView& view) {
      return names(view) || std::ranges::any_of(facts_.infos, [&](const RecordedCameraInfo& info) {
               return names(info) && namespace_of(info.topic) == namespace_of(view.topic);
             });
    };
    if (!choose(choice_.camera_topic, shares) && std::ranges::none_of(facts_.infos, names))
      ambiguous(fmt::format("the recording has no camera on topic '{}'", choice_.camera_topic),
                "`waymark info` lists the topics.");
  }
  const std::string frame = frame_name(choice_.camera_frame);
  choose(frame, [&](const RecordedView& view) { return view.frame == frame; });
  // Tags take precedence over the images in which they were detected.
  std::map<std::string, std::vector<std::string>> topics_of_frame;
  const bool tags = std::ranges::any_of(all, [](const RecordedView& view) { return !view.image; });
  for (const RecordedView& view : all)
    if (view.image != tags) topics_of_frame[view.frame].push_back(view.topic);
  if (topics_of_frame.size() > 1) {
    std::string list;
    for (const auto& [name, topics] : topics_of_frame) chosen_.frames.push_back(name);
    for (const auto& [name, topics] : topics_of_frame)
      list += fmt::format("\n  {}  ({})", name, fmt::join(topics, ", "));
    ambiguous(fmt::format("the recording has {} cameras:{}", topics_of_frame.size(), list),
              fmt::format("Choose one with `camera_frame`, for example `camera_frame={}`.",
                          topics_of_frame.begin()->first));
  }
  if (!topics_of_frame.empty()) {
    const std::string& chosen = topics_of_frame.begin()->first;
    for (const RecordedView& view : all) {
      if (view.frame == chosen) {
        views_.push_back(view);
      } else {
        chosen_.unused.insert(view.topic);
      }
    }
  }
  keep_one_copy();
}

/// Keeps one of the raw, compressed and rectified copies of an image, so that tags are not detected more than
/// once.
void CameraSelector::keep_one_copy() {
  std::vector<const RecordedView*> images;
  for (const RecordedView& view : views_)
    if (view.image) images.push_back(&view);
  if (images.size() < 2) return;
  const auto rank = [](const RecordedView* view) {
    return std::pair(is_rectified(view->topic), unpacked_topic(view->topic) != view->topic);
  };
  const RecordedView* best = *std::ranges::min_element(images, {}, rank);
  std::vector<std::string> others;
  for (const RecordedView* view : images) {
    if (view == best) continue;
    others.push_back(view->topic);
    chosen_.unused.insert(view->topic);
  }
  note(fmt::format("images of {} are used, not {} (set `camera_topic` to change this)", best->topic,
                   fmt::join(others, ", ")));
  std::erase_if(views_, [&](const RecordedView& view) { return chosen_.unused.contains(view.topic); });
}

/// Whether the cameras map a ray to different pixels. Models with and without zero coefficients do not
/// differ.
bool differ(const CameraModel& a, const CameraModel& b) {
  constexpr double kSame_px = 0.01;
  constexpr int kSteps = 8;
  for (int i = 0; i <= kSteps * (kSteps + 2); ++i) {
    const Eigen::Vector2d share(i % (kSteps + 1), i / (kSteps + 1));
    const Eigen::Vector2d px = share.cwiseProduct(Eigen::Vector2d(a.width_px(), a.height_px())) / kSteps;
    const auto ray = a.normalize(px);
    if (!ray) continue;
    const auto other = b.project({ray->x(), ray->y(), 1});
    if (!other || (*other - px).norm() > kSame_px) return true;
  }
  return false;
}

void CameraSelector::choose_info() {
  std::vector<const RecordedCameraInfo*> fitting;
  fitting.reserve(facts_.infos.size());
  for (const RecordedCameraInfo& info : facts_.infos) fitting.push_back(&info);
  const auto narrow = [&](auto takes) {
    std::vector<const RecordedCameraInfo*> kept;
    std::ranges::copy_if(fitting, std::back_inserter(kept), takes);
    if (!kept.empty()) fitting = std::move(kept);
  };
  if (!choice_.camera_topic.empty())
    narrow([&](const auto* info) { return is_on_topic(info->topic, choice_.camera_topic); });
  const auto beside = [&](const auto* info) {
    return std::ranges::any_of(views_, [&](const RecordedView& view) {
      return namespace_of(view.topic) == namespace_of(info->topic);
    });
  };
  const auto same_frame = [&](const auto* info) {
    return std::ranges::any_of(views_, [&](const RecordedView& view) { return view.frame == info->frame; });
  };
  if (fitting.size() > 1) narrow(same_frame);
  if (fitting.size() > 1) narrow(beside);
  if (fitting.size() > 1 && !choice_.camera_frame.empty())
    narrow([&](const auto* info) { return info->frame == frame_name(choice_.camera_frame); });
  if (fitting.size() > 1) narrow([](const auto* info) { return info->camera.has_value(); });
  if (fitting.empty()) return;
  const RecordedCameraInfo& info = *fitting.front();
  const bool one =
      std::ranges::all_of(fitting, [&](const auto* other) { return other->camera == info.camera; });
  if (!one) {
    std::vector<std::string> topics;
    topics.reserve(fitting.size());
    for (const auto* other : fitting) topics.push_back(other->topic);
    ambiguous(fmt::format("several calibrations match the camera: {}", fmt::join(topics, ", ")),
              fmt::format("Choose one with `camera_topic`, for example `camera_topic={}`.", topics.front()));
  }
  const bool rectified =
      std::ranges::any_of(views_, [](const RecordedView& view) { return is_rectified(view.topic); });
  chosen_.camera = rectified && info.rectified ? info.rectified : info.camera;
  chosen_.camera_error = info.error;
  if (rectified && info.rectified) note("images are rectified: using the projection matrix of " + info.topic);
  const bool only_tags =
      !views_.empty() && std::ranges::none_of(views_, [](const RecordedView& view) { return view.image; });
  if (only_tags && !rectified && info.camera && info.rectified && differ(*info.camera, *info.rectified))
    chosen_.rectified = info.rectified;
  check_size(info);
  if (facts_.infos.size() > 1) note("using the camera calibration of " + info.topic);
  if (views_.empty()) views_.push_back({info.topic, info.frame, false, {}});
  if (views_.front().frame.empty()) views_.front().frame = info.frame;
}

/// Rejects a calibration for another image size. If the recording contains tags, its images are not used, so
/// a different size only causes a note.
void CameraSelector::check_size(const RecordedCameraInfo& info) {
  if (!chosen_.camera) return;
  const bool tags = std::ranges::any_of(views_, [](const RecordedView& view) { return !view.image; });
  for (const RecordedView& view : views_) {
    if (!view.image || view.width_px == 0) continue;
    Status fits = check_camera_matches_image(*chosen_.camera, view.width_px, view.height_px);
    if (fits) continue;
    Error error = fits.error();
    error.message =
        fmt::format("calibration{} and images ({}) do not match: {}", info.part, view.topic, error.message);
    if (!info.part.empty())
      error.hint =
          "If the calibration is that of the recorded images, pass it with `robot=FILE`: the camera "
          "driver must set binning and region to 0.";
    error.place.key = info.topic;
    if (tags) {
      note(to_string(error));
      continue;
    }
    chosen_.camera.reset();
    chosen_.camera_error = std::move(error);
    return;
  }
}

void CameraSelector::choose_motion(bool imu, const std::string& requested, std::string_view usual,
                                   const char* field) {
  std::vector<const RecordedMotion*> all;
  for (const RecordedMotion& motion : facts_.motions)
    if (motion.imu == imu && motion.parent.empty()) all.push_back(&motion);
  if (all.empty()) return;
  const RecordedMotion* chosen = all.size() == 1 ? all.front() : nullptr;
  for (const RecordedMotion* motion : all) {
    if (!requested.empty() && motion->topic == requested) chosen = motion;
    const bool as_usual = motion->topic.ends_with("/" + std::string(usual));
    if (requested.empty() && chosen == nullptr && as_usual) chosen = motion;
  }
  std::vector<std::string> topics;
  topics.reserve(all.size());
  for (const RecordedMotion* motion : all) topics.push_back(motion->topic);
  if (chosen == nullptr || (!requested.empty() && chosen->topic != requested)) {
    ambiguous(requested.empty() ? fmt::format("the recording has {} {} topics: {}", all.size(),
                                              imu ? "IMU" : "odometry", fmt::join(topics, ", "))
                                : fmt::format("the recording has no {} on '{}', only on {}",
                                              imu ? "IMU" : "odometry", requested, fmt::join(topics, ", ")),
              fmt::format("Choose one with `{}`, for example `{}={}`.", field, field, topics.front()));
    return;
  }
  (imu ? imu_ : odometry_) = chosen;
  if (!imu) chosen_.odometry = chosen->topic;
  for (const RecordedMotion* motion : all)
    if (motion != chosen) chosen_.unused.insert(motion->topic);
  if (all.size() > 1)
    note(fmt::format("{} of {} is used, one of {} topics (set `{}` to change this)",
                     imu ? "the IMU" : "odometry", chosen->topic, all.size(), field));
}

/// The transforms of a robot that moves which may be its odometry.
std::vector<const RecordedMotion*> CameraSelector::moving_transforms() {
  std::vector<const RecordedMotion*> all;
  for (const RecordedMotion& motion : facts_.motions) {
    if (!leads_to_base(motion, choice_)) continue;
    if (motion.only_pose && !choice_.quick)
      note(fmt::format("the transforms on {} never change, so they are not used as odometry",
                       words_of(motion.link())));
    else
      all.push_back(&motion);
  }
  return all;
}

/// Selects the transforms that are the odometry, if no topic contains any.
void CameraSelector::choose_transforms() {
  std::vector<const RecordedMotion*> all = moving_transforms();
  if (all.empty()) return;
  const auto narrow = [&](auto takes) {
    std::vector<const RecordedMotion*> kept;
    std::ranges::copy_if(all, std::back_inserter(kept), takes);
    if (!kept.empty()) all = std::move(kept);
  };
  const std::string& topic = choice_.odometry_topic;
  narrow([&](const auto* motion) { return motion->topic == topic; });
  if (!topic.empty() && all.front()->topic != topic) {
    ambiguous(fmt::format("the recording has no odometry on '{}', only on {}", topic,
                          words_of(all.front()->link())),
              "Omit `odometry_topic`.");
    return;
  }
  const std::string base = frame_name(choice_.base_frame);
  narrow([&](const auto* motion) { return motion->frame == base; });
  const std::string camera = find_camera();
  if (all.size() > 1)
    narrow([&](const auto* motion) {
      return motion->frame == camera || facts_.frames.below(motion->frame, camera);
    });
  const std::string child = all.front()->frame;
  if (std::ranges::all_of(all, [&](const auto* motion) { return motion->frame == child; }))
    narrow([](const auto* motion) { return motion->parent == "odom"; });
  if (all.size() == 1)
    use_transforms(*all.front());
  else
    note_several(all);
}

void CameraSelector::use_transforms(const RecordedMotion& motion) {
  odometry_ = &motion;
  chosen_.odometry = words_of(motion.link());
  chosen_.odometry_frames = motion.link();
  note(odometry_note(chosen_));
}

void CameraSelector::note_several(const std::vector<const RecordedMotion*>& all) {
  std::vector<std::string> links;
  links.reserve(all.size());
  for (const RecordedMotion* motion : all) links.push_back(words_of(motion->link()));
  note(
      fmt::format("odometry is not read from transforms, because several may be that of the robot: {} (set "
                  "`base_frame` or `odometry_topic` to choose one)",
                  fmt::join(links, ", ")));
}

/// The camera frame; empty if unknown.
std::string CameraSelector::find_camera() const {
  if (!choice_.camera_frame.empty()) return frame_name(choice_.camera_frame);
  if (!views_.empty() && !views_.front().frame.empty()) return views_.front().frame;
  std::vector<std::string> optical;
  for (const std::string& frame : facts_.frames.frames())
    if (frame.find(kOptical) != std::string::npos) optical.push_back(frame);
  return optical.size() == 1 ? optical.front() : "";
}

/// The base frame that transforms connect to the camera.
std::string CameraSelector::find_base(const std::string& camera) {
  if (!choice_.base_frame.empty()) return frame_name(choice_.base_frame);
  if (odometry_ != nullptr && !odometry_->frame.empty()) return odometry_->frame;
  constexpr std::array<std::string_view, 2> kUsual = {"base_link", "base_footprint"};
  for (const std::string_view name : kUsual) {
    std::vector<std::string> found;
    for (const std::string& frame : facts_.frames.frames())
      if (is_named(frame, name) && facts_.frames.joined(frame, camera)) found.push_back(frame);
    if (found.size() == 1) return found.front();
    if (found.size() > 1)
      ambiguous(fmt::format("the camera '{}' is connected to several base frames: {}", camera,
                            fmt::join(found, ", ")),
                fmt::format("Choose one, for example `base_frame={}`.", found.front()));
    if (!found.empty()) return found.front();
  }
  return "base_link";
}

/// Optical frames have z forward; body frames have z up and x forward.
bool has_axes_of_a_body(const SE3& base_T_frame) {
  constexpr double kNear_rad = 0.8;
  return base_T_frame.rotation().log().norm() < kNear_rad;
}

void CameraSelector::find_mounting() {
  const std::string camera = find_camera();
  const bool in_header = !views_.empty() && !views_.front().frame.empty();
  if (choice_.camera_frame.empty() && !in_header && !camera.empty())
    note(fmt::format("no header contains the camera frame; assumed to be '{}'", camera));
  const FrameTree& frames = facts_.frames;
  if (frames.empty()) {
    if (!choice_.base_frame.empty() || !choice_.camera_frame.empty())
      chosen_.mounting_error =
          Error{ErrorCode::NotFound,
                "the recording has no transforms (/tf_static, /tf)",
                {},
                "Omit `base_frame` and `camera_frame`, and pass the mounting with `robot=FILE`."};
    return;
  }
  if (camera.empty()) {
    if (!views_.empty())
      chosen_.mounting_error = Error{ErrorCode::NotFound,
                                     "no header contains the camera frame; " + frames.text(),
                                     {},
                                     "Set it with `camera_frame`."};
    return;
  }
  const std::string base = find_base(camera);
  chosen_.base_frame = base;
  chosen_.camera_frame = camera;
  const Result<SE3> base_T_cam = frames.chain(base, camera);
  if (!base_T_cam) {
    chosen_.mounting_error = base_T_cam.error();
    return;
  }
  const bool named_optical = camera.find(kOptical) != std::string::npos;
  if (choice_.camera_frame.empty() && !named_optical && has_axes_of_a_body(*base_T_cam)) {
    chosen_.mounting_error = Error{
        ErrorCode::NotFound,
        fmt::format("the camera frame '{}' has body axes (x ahead, z up), but an optical frame has x "
                    "right, y down, z ahead; {}",
                    camera, frames.text()),
        {},
        "Set the optical frame with `camera_frame`; set `camera_frame` to this frame to use it unchanged."};
    return;
  }
  chosen_.base_T_cam = *base_T_cam;
}

/// The IMU in a camera has the axes of the camera, not of the base.
void CameraSelector::turn_imu() {
  if (imu_ == nullptr || imu_->frame.empty() || chosen_.base_frame.empty() ||
      imu_->frame == chosen_.base_frame)
    return;
  if (const Result<SE3> base_T_imu = facts_.frames.chain(chosen_.base_frame, imu_->frame)) {
    chosen_.base_R_imu = base_T_imu->rotation();
    return;
  }
  note(fmt::format(
      "no chain of transforms connects '{}' to the IMU frame '{}'; the IMU axes are assumed to be those "
      "of the base",
      chosen_.base_frame, imu_->frame));
}

}  // namespace

bool shows_distances(const RecordedView& view) {
  if (view.encoding == "32FC1" || view.topic.ends_with("/compressedDepth")) return true;
  // Infrared and thermal cameras use 16UC1 as well.
  const auto contains = [&](std::string_view part) { return view.topic.find(part) != std::string::npos; };
  return view.encoding == "16UC1" && (contains("depth") || contains("disparity") || contains("/range"));
}

std::optional<Error> only_depth_images(const CameraFacts& facts) {
  std::vector<std::string> topics;
  for (const RecordedView& view : facts.views) {
    if (!view.image) continue;
    if (!shows_distances(view)) return std::nullopt;
    topics.push_back(view.topic);
  }
  if (topics.empty()) return std::nullopt;
  return Error{ErrorCode::NotFound,
               "this recording contains only depth images, in which no tags can be detected",
               {.key = fmt::format("{}", fmt::join(topics, ", "))},
               "Record the colour or infrared images of the camera too."};
}

ChosenCamera choose_camera(const CameraFacts& facts, const CameraChoice& choice) {
  return CameraSelector(facts, choice).run();
}

std::vector<ChosenCamera> choose_all_cameras(const CameraFacts& facts, const CameraChoice& choice) {
  if (!choice.camera_frame.empty() || !choice.camera_topic.empty()) return {};
  std::vector<std::string> frames = choose_camera(facts, choice).frames;
  std::ranges::stable_sort(frames, {}, [&](const std::string& frame) {
    return std::ranges::find(facts.infos, frame, &RecordedCameraInfo::frame) - facts.infos.begin();
  });
  std::vector<ChosenCamera> all;
  for (const std::string& frame : frames) {
    CameraChoice one = choice;
    one.camera_frame = frame;
    ChosenCamera camera = choose_camera(facts, one);
    const bool calibrated =
        std::ranges::find(facts.infos, frame, &RecordedCameraInfo::frame) != facts.infos.end();
    if (camera.ambiguous || !calibrated || !camera.camera || !camera.base_T_cam) return {};
    all.push_back(std::move(camera));
  }
  return all;
}

std::map<std::string, CameraModel> image_cameras(const CameraFacts& facts) {
  std::map<std::string, std::vector<std::optional<CameraModel>>> by_frame;
  for (const RecordedView& view : facts.views) {
    if (!view.image || shows_distances(view)) continue;
    const ChosenCamera chosen = choose_camera(facts, {.camera_topic = view.topic});
    by_frame[view.frame].push_back(chosen.ambiguous ? std::nullopt : chosen.camera);
  }
  std::map<std::string, CameraModel> cameras;
  for (const auto& [frame, models] : by_frame) {
    const bool named = std::ranges::find(facts.infos, frame, &RecordedCameraInfo::frame) != facts.infos.end();
    const bool equal =
        std::ranges::all_of(models, [&](const auto& model) { return model == models.front(); });
    if ((named || by_frame.size() == 1) && equal && models.front())
      cameras.emplace(ros2::camera_of_frame(frame), *models.front());
  }
  return cameras;
}

namespace {

/// The first camera becomes the selected camera; topics that no camera uses are not read.
void use_all(std::vector<ChosenCamera> cameras, RecordingSetup& setup) {
  setup.chosen = cameras.front();
  std::vector<std::string> frames;
  for (const ChosenCamera& camera : cameras) {
    std::set<std::string> unused;
    std::ranges::set_intersection(setup.chosen.unused, camera.unused, std::inserter(unused, unused.end()));
    setup.chosen.unused = std::move(unused);
    frames.push_back(camera.camera_frame);
  }
  for (auto camera = cameras.begin() + 1; camera != cameras.end(); ++camera)
    setup.more_cameras.push_back(
        {ros2::camera_of_frame(camera->camera_frame), *camera->camera, *camera->base_T_cam});
  setup.chosen.notes = {fmt::format("all {} cameras are used: {} (set `camera_frame` to use one)",
                                    frames.size(), fmt::join(frames, ", "))};
  if (setup.chosen.odometry_frames) setup.chosen.notes.push_back(odometry_note(setup.chosen));
}

}  // namespace

ImageLens lens_of(const RecordingSetup& setup, std::string_view camera) {
  const auto found = std::ranges::find(setup.more_cameras, camera, &MountedCamera::name);
  if (found != setup.more_cameras.end()) return ImageLens::of(found->camera);
  return setup.camera ? ImageLens::of(*setup.camera) : ImageLens::unknown();
}

void choose(RecordingSetup& setup, const CameraChoice& choice) {
  setup.more_cameras.clear();
  if (auto all = choose_all_cameras(setup.facts, choice); !all.empty())
    use_all(std::move(all), setup);
  else
    setup.chosen = choose_camera(setup.facts, choice);
  setup.camera = setup.chosen.camera;
  setup.base_T_cam = setup.chosen.base_T_cam;
}

void turn_into_base(Sample& sample, const ChosenCamera& chosen) {
  auto* imu = std::get_if<ImuSample>(&sample);
  if (imu == nullptr || !chosen.base_R_imu) return;
  imu->angular_velocity_rad_s = *chosen.base_R_imu * imu->angular_velocity_rad_s;
  imu->linear_acceleration_m_s2 = *chosen.base_R_imu * imu->linear_acceleration_m_s2;
}

}  // namespace waymark
