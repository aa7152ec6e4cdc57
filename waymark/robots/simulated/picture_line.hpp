#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "waymark/robots/simulated/detecting_camera.hpp"

namespace waymark {

/// Pictures taken and looked at by several threads, and given back in the order in which they were asked for,
/// so that whatever is made of them does not depend on the number of threads.
class PictureLine {
 public:
  /// One thread an scene_camera; with a single scene_camera none: pictures are then taken by whoever asks for
  /// them.
  explicit PictureLine(std::vector<std::unique_ptr<DetectingCamera>> scene_cameras);
  ~PictureLine();
  PictureLine(const PictureLine&) = delete;
  PictureLine& operator=(const PictureLine&) = delete;

  /// Asks for a picture. Never waits: the caller keeps pending() small.
  void push(CameraShot shot);
  /// Pictures asked for and not yet given back.
  [[nodiscard]] std::size_t pending() const { return jobs_.size(); }
  /// Whether pop() would not wait.
  [[nodiscard]] bool ready() const;
  /// The oldest picture; waits for it. There must be one pending.
  [[nodiscard]] Result<SeenPicture> pop();

 private:
  struct Job {
    CameraShot shot;
    std::optional<Result<SeenPicture>> result{};
    bool taken = false;
  };
  void work(DetectingCamera& scene_camera);

  std::vector<std::unique_ptr<DetectingCamera>> cameras_;
  mutable std::mutex mutex_;
  std::condition_variable work_to_do_;
  std::condition_variable picture_done_;
  std::deque<std::shared_ptr<Job>> jobs_;
  bool closing_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace waymark
