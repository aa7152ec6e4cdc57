#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <unistd.h>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "python/bindings/errors.hpp"
#include "python/bindings/finite_samples.hpp"
#include "python/bindings/log_reader.hpp"
#include "python/bindings/rooms.hpp"
#include "python/bindings/values.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark::python {
namespace {

/// Raises InvalidArgument for a topic that the recording does not have.
void check_topics(const MessageLog& log, const std::set<std::string>& topics) {
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : topics)
    if (std::ranges::find(known, topic) == known.end())
      refuse("topics", fmt::format("the recording has no topic '{}'", topic), suggestion(topic, known));
}

LogSelection selection_of(const MessageLog& log, const std::optional<std::set<std::string>>& topics,
                          std::optional<std::uint64_t> from, std::optional<std::uint64_t> to) {
  LogSelection selection;
  if (topics) {
    check_topics(log, *topics);
    selection.topics = *topics;
  }
  if (from) selection.from = *from;
  if (to) selection.to = *to;
  return selection;
}

/// A recording in Python: its summary, and a separate reader for each iteration.
struct Recording {
  std::string path;
  std::unique_ptr<MessageLog> log{};
  std::shared_ptr<ReadProblems> read = std::make_shared<ReadProblems>();  ///< found by iterators
};

std::unique_ptr<Recording> open_recording(const std::filesystem::path& path) {
  auto recording = std::make_unique<Recording>(Recording{.path = path});
  const py::gil_scoped_release release;
  recording->log = value_of(open_log(path));
  return recording;
}

py::list channels_of(const Recording& recording) {
  py::list all;
  for (const LogChannel& channel : recording.log->channels()) {
    py::dict one;
    one["topic"] = channel.topic;
    one["type"] = channel.type;
    one["encoding"] = channel.encoding;
    one["messages"] = channel.messages;
    all.append(one);
  }
  return all;
}

py::dict recording_summary(const Recording& recording) {
  const LogSummary summary = recording.log->summary();
  py::dict answer;
  answer["format"] = std::string(to_string(recording.log->format()));
  answer["description"] = recording.log->description();
  answer["start_ns"] = summary.start;
  answer["end_ns"] = summary.end;
  answer["messages"] = summary.messages;
  answer["size_bytes"] = summary.size_bytes;
  answer["complete"] = summary.complete;
  return answer;
}

py::dict recording_setup(Recording& recording) {
  const RecordingSetup setup = value_of(recording.log->setup());
  py::dict answer;
  answer["camera"] = setup.camera;
  answer["base_T_cam"] = setup.base_T_cam;
  answer["metadata"] = setup.metadata;
  return answer;
}

py::dict attachments_of(Recording& recording) {
  py::dict answer;
  check(recording.log->visit_attachments([&](const MessageLog::Attachment& attachment) -> Status {
    answer[py::str(attachment.name)] =
        py::bytes(reinterpret_cast<const char*>(attachment.data.data()), attachment.data.size());
    return {};
  }));
  return answer;
}

std::vector<std::string> problems_of(const Recording& recording) {
  const std::scoped_lock lock(recording.read->mutex);
  if (!recording.read->words.empty()) return recording.read->words;
  std::vector<std::string> words;
  for (const LogProblem& problem : recording.log->problems()) words.push_back(to_string(problem));
  return words;
}

/// A recorder that raises an exception if it is used after it was closed.
class Writer {
 public:
  explicit Writer(const std::filesystem::path& path)
      : path_(path),
        process_(getpid()),
        recorder_(std::make_unique<SampleRecorder>(
            value_of(SampleRecorder::open(value_of(create_file(path)), {.library = "waymark python"})))) {}
  ~Writer() {
    if (!recorder_) return;
    if (!is_own()) {
      leave();
      return;
    }
    const py::error_scope kept;  // preserves an exception in flight
    warn();
    try {
      close();
    } catch (const std::exception& failure) {
      PyErr_SetString(PyExc_OSError, failure.what());
      PyErr_WriteUnraisable(nullptr);
    }
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  void add(const Sample& sample) {
    if (const char* name = not_finite(sample))
      refuse(name, "the value is not finite", "Omit values that were not measured.");
    check(open().add(sample));
  }
  void add_camera(std::int64_t stamp_ns, const CameraModel& camera, const SE3& base_T_cam,
                  const std::string& name) {
    check(open().add_camera(SensorTime(Duration(stamp_ns)), camera, base_T_cam, name));
  }
  void add_metadata(const std::string& name, const std::map<std::string, std::string>& values) {
    check(open().add_metadata(name, values));
  }
  void add_attachment(const std::string& name, const std::string& media_type, const std::string& data) {
    check(open().add_attachment(name, media_type, {}, data));
  }
  void close() {
    if (!recorder_) return;
    if (!is_own()) return leave();
    const auto closing = std::move(recorder_);
    check(closing->close());
  }

 private:
  SampleRecorder& open() {
    if (!recorder_)
      throw py::value_error("the recording '" + path_ +
                            "' is closed; create another Writer for another file");
    if (!is_own())
      throw std::runtime_error("a Writer cannot be used after fork(): write a separate file in the child");
    return *recorder_;
  }
  /// After fork(), the file belongs to the parent, which completes it; the child does not touch the recorder.
  [[nodiscard]] bool is_own() const { return process_ == getpid(); }
  void leave() { static_cast<void>(recorder_.release()); }
  void warn() const {
    const std::string words = "a Writer of '" + path_ + "' was not closed: use it in a with statement";
    if (PyErr_WarnEx(PyExc_ResourceWarning, words.c_str(), 1) != 0) PyErr_WriteUnraisable(nullptr);
  }

  std::string path_;
  pid_t process_;
  std::unique_ptr<SampleRecorder> recorder_;
};

void bind_writer(py::module_& m) {
  py::class_<Writer> writer(
      m, "Writer",
      "Writes samples as ROS 2 messages to a new MCAP file (docs/formats/recording.md). Use it in a with "
      "statement. If a Writer is deleted without close(), it completes its file and issues a warning. In a "
      "child process after fork(), writing raises RuntimeError.");
  writer.def(py::init<const std::filesystem::path&>(), py::arg("path"),
             "Creates a new file; raises Unwritable if it already exists.");
  writer.def(
      "add", &Writer::add, py::arg("sample"),
      "Adds a sample, whose stamp becomes the log time. Raises InvalidArgument for non-finite values.");
  writer.def("add_camera", &Writer::add_camera, py::arg("stamp_ns"), py::arg("camera"), py::arg("base_T_cam"),
             py::arg("name") = "cam",
             "Adds the lens and mounting (SE3) of a camera. Call it before its first image.");
  writer.def("add_metadata", &Writer::add_metadata, py::arg("name"), py::arg("values"),
             "Adds metadata as a dictionary of strings.");
  writer.def("add_attachment", &Writer::add_attachment, py::arg("name"), py::arg("media_type"),
             py::arg("data"), "Attaches a file to the recording.");
  writer.def("close", &Writer::close, "Writes the summary and closes the file. Further calls do nothing.");
  writer.def("__enter__", [](const py::object& self) { return self; });
  writer.def("__exit__", [](Writer& self, const py::args& raised) {
    try {
      self.close();
    } catch (const Raised&) {
      if (raised.empty() || raised[0].is_none())
        throw;  // otherwise the error in flight takes precedence, for example a full disk
    }
  });
  refuse_pickle(writer, "it writes an open file");
}

}  // namespace

void bind_recording(py::module_& m) {
  m.doc() = "Reads MCAP, rosbag2, ROS 1 bags, LCM logs and CSV tables; writes MCAP.";
  py::class_<LogReader> iterator(m, "Iterator",
                                 "Messages or samples of a recording, read ahead in a thread.");
  iterator.def("__iter__", [](const py::object& self) { return self; });
  iterator.def("__next__", &LogReader::next);
  iterator.def("close", &LogReader::close, "Stops reading. Further calls do nothing.");
  refuse_pickle(iterator, "it reads an open file; open the recording again");
  const auto topics = py::arg("topics") = py::none();
  const auto from = py::arg("from_ns") = py::none();
  const auto to = py::arg("to_ns") = py::none();
  py::class_<Recording> recording(m, "Recording",
                                  "A recording in any supported format. Iteration yields its samples.");
  recording.def(py::init(&open_recording), py::arg("path"),
                "The format is detected from the first bytes. Raises NotFound or Unreadable.");
  recording.def("__repr__", [](const Recording& r) {
    return fmt::format("Recording('{}', {})", r.path, to_string(r.log->format()));
  });
  recording.def_readonly("path", &Recording::path, "Path of the file or folder.");
  recording.def_property_readonly(
      "channels", &channels_of,
      "For each channel, a dictionary with topic, type, encoding and message count.");
  recording.def_property_readonly("summary", &recording_summary, "Format, times [ns] and size.");
  recording.def_property_readonly(
      "setup", &recording_setup,
      "camera (CameraModel), base_T_cam (SE3) and metadata; None if not recorded.");
  recording.def_property_readonly("attachments", &attachments_of, "The attached files: bytes by name.");
  recording.def_property_readonly(
      "problems", &problems_of,
      "Problems as text: first those found on opening, then the data skipped by the last finished iterator.");
  recording.def(
      "samples",
      [](const Recording& r, const std::optional<std::set<std::string>>& names,
         std::optional<std::uint64_t> first, std::optional<std::uint64_t> last) {
        return LogReader::samples(r.path, selection_of(*r.log, names, first, last), r.read);
      },
      topics, from, to, "Iterator over the samples in order of time, with log times in [from_ns, to_ns).");
  recording.def(
      "messages",
      [](const Recording& r, const std::optional<std::set<std::string>>& names,
         std::optional<std::uint64_t> first, std::optional<std::uint64_t> last) {
        return LogReader::messages(r.path, selection_of(*r.log, names, first, last), r.read);
      },
      topics, from, to, "Iterator over (topic, type, log time [ns], raw bytes of the message).");
  recording.def("__iter__", [](const Recording& r) { return LogReader::samples(r.path, {}, r.read); });
  refuse_pickle(recording, "it holds an open file; pickle its path and open it again");
  bind_writer(m);
}

}  // namespace waymark::python
