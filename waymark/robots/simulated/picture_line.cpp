#include "waymark/robots/simulated/picture_line.hpp"

#include <algorithm>
#include <utility>

namespace waymark {

PictureLine::PictureLine(std::vector<std::unique_ptr<DetectingCamera>> scene_cameras)
    : cameras_(std::move(scene_cameras)) {
  if (cameras_.size() < 2) return;
  for (const auto& scene_camera : cameras_)
    threads_.emplace_back([this, &scene_camera] { work(*scene_camera); });
}

PictureLine::~PictureLine() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  work_to_do_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void PictureLine::work(DetectingCamera& scene_camera) {
  std::unique_lock lock(mutex_);
  while (true) {
    const auto waiting = [&] {
      return std::ranges::find(jobs_, false, [](const auto& j) { return j->taken; });
    };
    work_to_do_.wait(lock, [&] { return closing_ || waiting() != jobs_.end(); });
    if (closing_) return;
    const std::shared_ptr<Job> job = *waiting();
    job->taken = true;
    lock.unlock();
    auto seen = scene_camera.detect(job->shot);
    lock.lock();
    job->result = std::move(seen);
    picture_done_.notify_all();
  }
}

void PictureLine::push(CameraShot shot) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::make_shared<Job>(Job{.shot = std::move(shot)}));
  }
  work_to_do_.notify_one();
}

bool PictureLine::ready() const {
  const std::lock_guard lock(mutex_);
  return !jobs_.empty() && (threads_.empty() || jobs_.front()->result.has_value());
}

Result<SeenPicture> PictureLine::pop() {
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Job> job = jobs_.front();
  if (threads_.empty()) {
    jobs_.pop_front();
    return cameras_.front()->detect(job->shot);
  }
  picture_done_.wait(lock, [&] { return job->result.has_value(); });
  jobs_.pop_front();
  return std::move(*job->result);
}

}  // namespace waymark
