#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "waymark/cameras/v4l2/capture_stream.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark::internal {

/// The newest picture of a stream, still in the driver's memory. Giving it back keeps the stream alive.
struct TakenPicture {
  std::shared_ptr<CaptureStream> stream{};
  FilledBuffer buffer{};
  Duration arrived{};  ///< of the steady clock
  std::optional<Duration> exposure{};
};

/// Empties a stream as pictures come, and opens it again where it was unplugged.
class CaptureThread {
 public:
  CaptureThread(std::shared_ptr<CaptureStream> stream, V4l2Options options, std::string by_id);
  ~CaptureThread();
  CaptureThread(const CaptureThread&) = delete;
  CaptureThread& operator=(const CaptureThread&) = delete;

  /// Waits until there is a picture, words, or the end. The caller gives the picture's buffer back.
  [[nodiscard]] std::optional<TakenPicture> take(Duration most);
  [[nodiscard]] std::optional<std::string> take_words();
  [[nodiscard]] bool more() const;
  /// Why there will be no more pictures.
  [[nodiscard]] std::optional<Error> ended() const;
  /// The device as it is now; nullptr while it is unplugged.
  [[nodiscard]] std::shared_ptr<CaptureStream> stream() const;
  [[nodiscard]] CameraCounts counts() const;
  /// Asks for the exposure again with the next picture.
  void exposure_changed();

 private:
  void run();
  void capture(CaptureStream& stream);
  void put(const FilledBuffer& buffer);
  void lose(const Error& why);
  void find_again();
  void say(std::string words);
  void refresh_exposure(CaptureStream& stream);

  V4l2Options options_;
  std::string by_id_;
  Descriptor wake_;
  Duration lost_at_{};
  Duration last_picture_{};
  Duration exposure_asked_{};
  std::optional<std::uint32_t> sequence_{};
  bool silent_ = false;

  mutable std::mutex mutex_;  ///< guards what follows
  std::condition_variable changed_;
  std::shared_ptr<CaptureStream> stream_;
  std::optional<TakenPicture> newest_{};
  std::deque<std::string> words_{};
  std::optional<Error> ended_{};
  std::optional<Duration> exposure_{};
  CameraCounts counts_{};
  bool ask_exposure_ = true;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace waymark::internal
