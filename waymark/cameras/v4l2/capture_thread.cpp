#include "waymark/cameras/v4l2/capture_thread.hpp"

#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "waymark/cameras/v4l2/controls.hpp"

namespace waymark::internal {
namespace {

constexpr Duration kPatience = std::chrono::milliseconds(500);
constexpr Duration kRetry = std::chrono::milliseconds(250);
constexpr Duration kSilence = std::chrono::seconds(2);
constexpr Duration kExposureAge = std::chrono::seconds(1);  // each question is a transfer over USB
constexpr std::size_t kMostWords = 16;

}  // namespace

CaptureThread::CaptureThread(std::shared_ptr<CaptureStream> stream, V4l2Options options, std::string by_id)
    : options_(std::move(options)),
      by_id_(std::move(by_id)),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      last_picture_(steady_now()),
      stream_(std::move(stream)),
      thread_([this] { run(); }) {}

CaptureThread::~CaptureThread() {
  {
    const std::scoped_lock hold(mutex_);
    stop_ = true;
  }
  const std::uint64_t one = 1;
  (void)!::write(wake_.number(), &one, sizeof one);
  thread_.join();
}

void CaptureThread::run() {
  while (true) {
    std::shared_ptr<CaptureStream> stream;
    {
      const std::scoped_lock hold(mutex_);
      if (stop_ || ended_) return;
      stream = stream_;
    }
    if (stream != nullptr)
      capture(*stream);
    else
      find_again();
  }
}

void CaptureThread::capture(CaptureStream& stream) {
  refresh_exposure(stream);
  stream.wait(kPatience, wake_.number());
  while (true) {
    auto filled = stream.take();
    if (!filled) return lose(filled.error());
    if (!*filled) break;
    put(**filled);
  }
  if (!silent_ && steady_now() - last_picture_ > kSilence) {
    silent_ = true;
    say("the camera has delivered no picture for two seconds: check its cable");
  }
}

void CaptureThread::put(const FilledBuffer& buffer) {
  const Duration now = steady_now();
  last_picture_ = now;
  if (std::exchange(silent_, false)) say("the camera delivers pictures again");
  const std::uint32_t missing = sequence_ ? buffer.sequence - *sequence_ - 1 : 0;
  sequence_ = buffer.sequence;
  std::optional<TakenPicture> replaced;
  {
    const std::scoped_lock hold(mutex_);
    if (missing < 0x80000000U) counts_.lost += missing;  // else the driver began its numbers anew
    replaced = std::exchange(newest_, TakenPicture{stream_, buffer, now, exposure_});
    if (replaced) ++counts_.dropped;
  }
  if (replaced) replaced->stream->give_back(replaced->buffer.index);
  changed_.notify_all();
}

void CaptureThread::lose(const Error& why) {
  lost_at_ = steady_now();
  sequence_.reset();
  std::shared_ptr<CaptureStream> closed;
  {
    const std::scoped_lock hold(mutex_);
    closed = std::move(stream_);
    stream_.reset();
    newest_.reset();
  }
  say(fmt::format("{}; it is waited for", to_string(Error{why.code, why.message, why.place, {}})));
}

void CaptureThread::find_again() {
  {
    std::unique_lock hold(mutex_);
    if (changed_.wait_for(hold, kRetry, [this] { return stop_; })) return;
  }
  V4l2Options again = options_;
  auto stream = CaptureStream::open(again);
  if (!stream && !by_id_.empty()) {
    again.device = by_id_;
    stream = CaptureStream::open(again);
  }
  if (!stream && steady_now() - lost_at_ < options_.reconnect_within) return;
  if (stream) say(fmt::format("{}: the camera is there again", again.device));
  {
    const std::scoped_lock hold(mutex_);
    if (stream)
      stream_ = std::move(*stream);
    else
      ended_ = stream.error();
    ask_exposure_ = true;
  }
  last_picture_ = steady_now();
  changed_.notify_all();
}

void CaptureThread::refresh_exposure(CaptureStream& stream) {
  const Duration now = steady_now();
  {
    const std::scoped_lock hold(mutex_);
    if (!std::exchange(ask_exposure_, false) && now - exposure_asked_ < kExposureAge) return;
  }
  exposure_asked_ = now;
  const std::optional<Duration> exposure = exposure_of(stream.number());
  const std::scoped_lock hold(mutex_);
  exposure_ = exposure;
}

void CaptureThread::say(std::string words) {
  {
    const std::scoped_lock hold(mutex_);
    if (words_.size() < kMostWords) words_.push_back(std::move(words));
  }
  changed_.notify_all();
}

std::optional<TakenPicture> CaptureThread::take(Duration most) {
  std::unique_lock hold(mutex_);
  changed_.wait_for(hold, most, [this] { return newest_ || !words_.empty() || ended_; });
  if (!words_.empty()) return std::nullopt;
  return std::exchange(newest_, std::nullopt);
}

std::optional<std::string> CaptureThread::take_words() {
  const std::scoped_lock hold(mutex_);
  if (words_.empty()) return std::nullopt;
  std::string words = std::move(words_.front());
  words_.pop_front();
  return words;
}

bool CaptureThread::more() const {
  const std::scoped_lock hold(mutex_);
  return newest_ || !words_.empty() || ended_;
}

std::optional<Error> CaptureThread::ended() const {
  const std::scoped_lock hold(mutex_);
  return words_.empty() ? ended_ : std::nullopt;
}

std::shared_ptr<CaptureStream> CaptureThread::stream() const {
  const std::scoped_lock hold(mutex_);
  return stream_;
}

CameraCounts CaptureThread::counts() const {
  const std::scoped_lock hold(mutex_);
  return counts_;
}

void CaptureThread::exposure_changed() {
  const std::scoped_lock hold(mutex_);
  ask_exposure_ = true;
}

}  // namespace waymark::internal
