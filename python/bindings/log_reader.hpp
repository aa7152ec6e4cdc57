#pragma once

#include <sys/types.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "waymark/recording/message_log.hpp"

namespace waymark::python {

/// Problems that were skipped by the last finished reader, as text.
struct ReadProblems {
  std::mutex mutex{};
  std::vector<std::string> words{};
};

/// Turns the callbacks of a recording into an iterator. A thread reads ahead by a few dozen items.
/// In a child process after fork(), next() raises RuntimeError, because the parent's reader cannot be
/// continued.
class LogReader {
 public:
  static std::unique_ptr<LogReader> samples(const std::string& path, LogSelection selection,
                                            std::shared_ptr<ReadProblems> problems);
  static std::unique_ptr<LogReader> messages(const std::string& path, LogSelection selection,
                                             std::shared_ptr<ReadProblems> problems);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// Raises StopIteration at the end and ValueError after close().
  pybind11::object next();
  void close();

 private:
  class Queue;
  LogReader(const std::string& path, const LogSelection& selection, bool samples,
            std::shared_ptr<ReadProblems> problems);

  std::shared_ptr<Queue> queue_;
  pid_t process_;
};

}  // namespace waymark::python
