#include "waymark/runtime/picture_queue.hpp"

#include <algorithm>
#include <utility>

namespace waymark {

void PictureQueue::push(CameraFrame picture) {
  const auto older = std::ranges::find(waiting_, picture.camera, &CameraFrame::camera);
  if (older == waiting_.end()) {
    waiting_.push_back(std::move(picture));
    return;
  }
  *older = std::move(picture);
  ++dropped_;
}

std::optional<CameraFrame> PictureQueue::pop() {
  if (waiting_.empty()) return std::nullopt;
  CameraFrame picture = std::move(waiting_.front());
  waiting_.pop_front();
  return picture;
}

}  // namespace waymark
