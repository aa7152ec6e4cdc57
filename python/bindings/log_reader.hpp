#pragma once

#include <sys/types.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <pybind11/pybind11.h>

#include "waymark/recording/message_log.hpp"

namespace waymark::python {

/// What the last reader that came to its end passed over, in words.
struct ReadProblems {
  std::mutex mutex{};
  std::vector<std::string> words{};
};

/// Turns a recording that calls back into one that is asked: a thread reads ahead, by a few dozen items.
/// After fork() the child cannot go on with its parent's reader, and is told so.
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
