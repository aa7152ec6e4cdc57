#include "python/bindings/log_reader.hpp"

#include <unistd.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <variant>

#include <pybind11/stl.h>

#include "python/bindings/errors.hpp"

namespace waymark::python {

/// A message as returned by the iterator. It is not in the anonymous namespace, because GCC would then warn
/// about LogReader::Queue.
struct RawMessage {
  std::string topic;
  std::string type;
  std::uint64_t log_time = 0;
  std::string data;
};
using LogItem = std::variant<Sample, RawMessage>;

namespace {

constexpr std::size_t kAhead = 32;

py::object to_python(LogItem item) {
  if (auto* sample = std::get_if<Sample>(&item)) return py::cast(std::move(*sample));
  const RawMessage& message = std::get<RawMessage>(item);
  return py::make_tuple(message.topic, message.type, message.log_time, py::bytes(message.data));
}

/// The error with which the consumer stops reading; it is never shown.
Status stop() { return fail(ErrorCode::Unreadable, "closed"); }

}  // namespace

/// State shared by the reading thread and the consumer. It is kept alive by the detached thread, so closing
/// never waits.
class LogReader::Queue {
 public:
  Status push(LogItem item) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || items_.size() < kAhead; });
    if (closed_) return stop();
    items_.push_back(std::move(item));
    changed_.notify_all();
    return {};
  }
  void end(Status status) {
    const std::scoped_lock lock(mutex_);
    end_ = std::move(status);
    changed_.notify_all();
  }
  void close() {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
    items_.clear();
    changed_.notify_all();
  }
  /// Empty at the end.
  Result<std::optional<LogItem>> pop() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || end_ || !items_.empty(); });
    if (!items_.empty()) {
      LogItem item = std::move(items_.front());
      items_.pop_front();
      changed_.notify_all();
      return std::optional(std::move(item));
    }
    if (end_ && !*end_) return tl::unexpected(end_->error());
    return std::optional<LogItem>();
  }
  [[nodiscard]] bool closed() {
    const std::scoped_lock lock(mutex_);
    return closed_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<LogItem> items_;
  std::optional<Status> end_{};
  bool closed_ = false;
};

LogReader::LogReader(const std::string& path, const LogSelection& selection, bool samples,
                     std::shared_ptr<ReadProblems> problems)
    : queue_(std::make_shared<Queue>()), process_(getpid()) {
  std::thread([queue = queue_, path, selection, samples, problems = std::move(problems)] {
    auto log = open_log(path);
    if (!log) return queue->end(tl::unexpected(log.error()));
    Status end =
        samples ? (*log)->visit_samples(selection, [&](const Sample& sample) { return queue->push(sample); })
                : (*log)->visit(selection, [&](const LogChannel& channel, const LogMessage& message) {
                    return queue->push(RawMessage{channel.topic,
                                                  channel.type,
                                                  message.log_time,
                                                  {message.data.begin(), message.data.end()}});
                  });
    {
      const std::scoped_lock lock(problems->mutex);
      problems->words.clear();
      for (const LogProblem& problem : (*log)->problems()) problems->words.push_back(to_string(problem));
    }
    queue->end(std::move(end));
  }).detach();
}

std::unique_ptr<LogReader> LogReader::samples(const std::string& path, LogSelection selection,
                                              std::shared_ptr<ReadProblems> problems) {
  return std::unique_ptr<LogReader>(new LogReader(path, selection, true, std::move(problems)));
}

std::unique_ptr<LogReader> LogReader::messages(const std::string& path, LogSelection selection,
                                               std::shared_ptr<ReadProblems> problems) {
  return std::unique_ptr<LogReader>(new LogReader(path, selection, false, std::move(problems)));
}

LogReader::~LogReader() {
  // In a child after fork() the mutex may be held by a thread that no longer exists, so it is not locked.
  if (queue_ && process_ == getpid()) queue_->close();
}

void LogReader::close() {
  if (process_ == getpid()) queue_->close();
}

py::object LogReader::next() {
  if (process_ != getpid())
    throw std::runtime_error(
        "an iterator over a recording cannot be used after fork(): open the recording again in the child");
  if (queue_->closed()) throw py::value_error("the iterator is closed");
  Result<std::optional<LogItem>> item;
  {
    const py::gil_scoped_release release;
    item = queue_->pop();
  }
  std::optional<LogItem> found = value_of(std::move(item));
  if (!found) throw py::stop_iteration();
  return to_python(std::move(*found));
}

}  // namespace waymark::python
