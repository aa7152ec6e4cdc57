#include "waymark/server/live_feed.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace waymark {
namespace {

constexpr std::size_t kMaxOrders = 64;
constexpr std::size_t kMaxSpare = 4;

}  // namespace

void LiveFeed::publish(const Sample& sample, std::int64_t host_ns) {
  if (!listening_.load(std::memory_order_relaxed)) return;
  const auto* image = std::get_if<CameraFrame>(&sample);
  if (image == nullptr || spare_.empty()) return add({sample, host_ns});
  CameraFrame copy = std::move(spare_.back());
  spare_.pop_back();
  copy = *image;
  add({Sample(std::move(copy)), host_ns});
}

void LiveFeed::publish(const ros2::PoseWithCovarianceStamped& estimate, std::int64_t host_ns) {
  if (!listening_.load(std::memory_order_relaxed)) return;
  add({estimate, host_ns});
}

void LiveFeed::publish(const ros2::DiagnosticArray& compared, std::int64_t host_ns) {
  if (!listening_.load(std::memory_order_relaxed)) return;
  add({compared, host_ns});
}

void LiveFeed::add(LiveSample sample) {
  if (waiting_.size() < kMaxWaiting)
    waiting_.push_back(std::move(sample));
  else
    dropped_.fetch_add(1, std::memory_order_relaxed);
  hand_over();
}

void LiveFeed::set_status(const LiveStatus& status) {
  if (status == last_status_) {
    if (status_waiting_) hand_over();
    return;
  }
  last_status_ = status;
  status_waiting_ = status;
  status_waiting_->reason = for_users_(status.reason);
  status_waiting_->halted = for_users_(status.halted);
  hand_over();
}

void LiveFeed::show_text(const std::string& name, std::string text) {
  std::string& shown = texts_.by_name[name];
  if (shown == text) return;
  shown = std::move(text);
  ++texts_.version;
  texts_waiting_ = std::make_shared<const LiveTexts>(texts_);
  hand_over();
}

void LiveFeed::show_camera(const CameraModel& camera, const SE3& base_T_cam) {
  camera_waiting_ = Mounted{camera, base_T_cam};
  hand_over();
}

void LiveFeed::show_shapes(ros2::MarkerArray shapes) {
  shapes_waiting_ = std::make_shared<const ros2::MarkerArray>(std::move(shapes));
  hand_over();
}

void LiveFeed::hand_over() {
  {
    const std::unique_lock<std::mutex> hand(box_, std::try_to_lock);
    if (!hand) return;
    std::vector<LiveSample>& samples = box_updates_.samples;
    const std::size_t room = kMaxWaiting - std::min(kMaxWaiting, samples.size());
    const std::size_t fits = std::min(room, waiting_.size());
    dropped_.fetch_add(waiting_.size() - fits, std::memory_order_relaxed);
    samples.insert(samples.end(), std::make_move_iterator(waiting_.begin()),
                   std::make_move_iterator(waiting_.begin() + static_cast<std::ptrdiff_t>(fits)));
    waiting_.clear();
    if (spare_.empty()) std::swap(spare_, box_spare_);
    if (status_waiting_) box_updates_.status = *std::exchange(status_waiting_, std::nullopt);
    if (texts_waiting_) box_updates_.texts = std::exchange(texts_waiting_, nullptr);
    if (shapes_waiting_) box_updates_.shapes = std::exchange(shapes_waiting_, nullptr);
    if (camera_waiting_) box_updates_.camera = std::exchange(camera_waiting_, std::nullopt);
  }
  wake_();
}

LiveFeed::Updates LiveFeed::take() {
  const std::scoped_lock hand(box_);
  Updates updates{.samples = std::move(box_updates_.samples),
                  .status = box_updates_.status,
                  .texts = box_updates_.texts,
                  .camera = box_updates_.camera,
                  .shapes = box_updates_.shapes};
  box_updates_.samples = {};
  return updates;
}

void LiveFeed::give_back(CameraFrame image) {
  const std::scoped_lock hand(box_);
  if (box_spare_.size() < kMaxSpare) box_spare_.push_back(std::move(image));
}

std::vector<ViewerOrder> LiveFeed::take_orders() {
  const std::unique_lock<std::mutex> hand(order_box_, std::try_to_lock);
  if (!hand) return {};
  return std::exchange(orders_, {});
}

void LiveFeed::order(const ViewerOrder& order) {
  const std::scoped_lock hand(order_box_);
  // The number of orders is limited, because the robot might not read them; a stop is never dropped.
  if (orders_.size() >= kMaxOrders) {
    if (order.kind != ViewerOrder::Kind::Stop) return;
    orders_.clear();
  }
  orders_.push_back(order);
}

}  // namespace waymark
