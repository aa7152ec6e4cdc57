#pragma once

#include <sys/types.h>

#include <memory>
#include <string>

#include <pybind11/pybind11.h>

#include "waymark/recording/message_log.hpp"

namespace waymark::python {

/// Turns a recording that calls back into one that is asked: a thread reads ahead, by a few dozen items.
/// After fork() the child cannot go on with its parent's reader, and is told so.
class LogReader {
 public:
  static std::unique_ptr<LogReader> samples(const std::string& path, LogSelection selection);
  static std::unique_ptr<LogReader> messages(const std::string& path, LogSelection selection);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// Raises StopIteration at the end and ValueError after close().
  pybind11::object next();
  void close();

 private:
  class Queue;
  LogReader(const std::string& path, const LogSelection& selection, bool samples);

  std::shared_ptr<Queue> queue_;
  pid_t process_;
};

}  // namespace waymark::python
