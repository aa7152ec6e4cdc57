#include "waymark/recording/message_log.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/csv/csv_log.hpp"
#include "waymark/recording/lcm/lcm_log.hpp"
#include "waymark/recording/mcap/mcap_log.hpp"
#include "waymark/recording/mcap/records.hpp"
#include "waymark/recording/ros1/bag_log.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros2/rosbag2_log.hpp"

namespace waymark {
namespace {

using OpenedLog = Result<std::unique_ptr<MessageLog>>;

/// How a recording format is recognised and read.
struct FormatRow {
  LogFormat format;
  std::string_view name;     ///< name used in JSON
  std::string_view known{};  ///< name in the list of supported formats; not listed if empty
  bool samples = false;      ///< contains samples rather than messages with ROS types
  /// Recognises the format from the first bytes and the size of the file; nullptr if it cannot be recognised.
  bool (*begins)(ByteSpan head, std::uint64_t size) = nullptr;
  OpenedLog (*open)(std::unique_ptr<ByteSource> source, const LogOptions& options) = nullptr;
  bool certain = true;  ///< the first bytes identify a recording with certainty
};

bool begins_with(ByteSpan head, ByteSpan magic) {
  return head.size() >= magic.size() && std::ranges::equal(head.first(magic.size()), magic);
}

/// A SQLite file is read by its path.
bool begins_as_sqlite(ByteSpan head) { return begins_with(head, as_bytes(kSqliteMagic)); }

bool begins_as_mcap(ByteSpan head, std::uint64_t /*size*/) { return begins_with(head, mcap::kMagic); }
bool begins_as_bag(ByteSpan head, std::uint64_t /*size*/) {
  return begins_with(head, as_bytes(ros1bag::kMagic));
}
bool begins_as_old_bag(ByteSpan head, std::uint64_t /*size*/) {
  return begins_with(head, as_bytes("#ROSBAG V1"));
}
bool begins_as_rosbag2(ByteSpan head, std::uint64_t /*size*/) { return begins_as_sqlite(head); }
bool begins_as_csv(ByteSpan head, std::uint64_t /*size*/) { return looks_like_csv(head); }

/// SQLite only reads files, so bytes from other sources are written to a temporary file.
OpenedLog open_sqlite(std::unique_ptr<ByteSource> source, const LogOptions& options) {
  constexpr std::size_t kPieceBytes = std::size_t{1} << 16U;
  if (const auto unpacked = unpacked_to(*source))
    return open_rosbag2_bytes(unpacked, source->name(), options);
  const Result<std::uint64_t> size = source->size();
  if (!size) return tl::unexpected(size.error());
  const auto file = TemporaryFile::create();
  if (!file) return tl::unexpected(file.error());
  Bytes piece;
  for (std::uint64_t at = 0; at < *size; at += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min<std::uint64_t>(kPieceBytes, *size - at)));
    Status status = source->read(at, piece);
    if (status) status = (*file)->append(piece);
    if (!status) return tl::unexpected(status.error());
  }
  return open_rosbag2_bytes(*file, source->name(), options);
}

OpenedLog open_old_bag(std::unique_ptr<ByteSource> source, const LogOptions& /*options*/) {
  return fail(ErrorCode::Unsupported, "this is a ROS bag of version 1 (before 2010)",
              {.source = source->name()}, "Convert it with `rosbag fix`.");
}

/// All formats, in the order in which they are tried. A new format needs a row here and a reader. CSV comes
/// last because it matches any text with a comma in its first line.
constexpr std::array kFormats = {
    FormatRow{LogFormat::Mcap, "mcap", "MCAP", false, begins_as_mcap, open_mcap_log},
    FormatRow{LogFormat::Rosbag2, "rosbag2", "rosbag2 (.db3, bag folder)", false, begins_as_rosbag2,
              open_sqlite},
    FormatRow{LogFormat::Ros1Bag, "ros1bag", "ROS 1 bag", false, begins_as_bag, open_ros1_bag},
    FormatRow{LogFormat::Ros1Bag, "ros1bag", "", false, begins_as_old_bag, open_old_bag},
    FormatRow{LogFormat::Lcm, "lcm", "LCM event log", true, looks_like_lcm, open_lcm_log},
    FormatRow{LogFormat::Csv, "csv", "CSV with named columns", true, begins_as_csv, open_csv_log, false},
    FormatRow{LogFormat::Merged, "merged", "", true},
};

const FormatRow& row_of(LogFormat format) { return *std::ranges::find(kFormats, format, &FormatRow::format); }

/// The supported formats as text: "MCAP, ROS 1 bag, …".
std::string known_formats() {
  std::string names;
  for (const FormatRow& row : kFormats)
    if (!row.known.empty()) names += (names.empty() ? "" : ", ") + std::string(row.known);
  return names;
}

/// Opens uncompressed bytes in the format recognised from their beginning, `head`. Fails if no format
/// matches.
Result<std::unique_ptr<MessageLog>> open_by_format(std::unique_ptr<ByteSource> source, ByteSpan head,
                                                   const LogOptions& options) {
  const Place place{.source = source->name()};
  std::error_code unknown;  // set if the source is not a file and hence not a device
  if (head.empty() && std::filesystem::is_character_file(place.source, unknown))
    return fail(ErrorCode::Unreadable, "this is a device, not a recording", place,
                "Name a file or a folder.");
  if (head.empty())
    return fail(ErrorCode::Unreadable, "the file is empty", place,
                "The recording was probably interrupted before its first message. Record again.");
  const std::uint64_t size = source->size().value_or(0);
  const bool yaml = place.source.ends_with(".yaml") || place.source.ends_with(".yml");
  for (const FormatRow& row : kFormats) {
    if (row.begins == nullptr || !row.begins(head, size) || (yaml && !row.certain)) continue;
    return row.open(std::move(source), options);
  }
  if (place.source.ends_with(".mcap"))
    return fail(ErrorCode::Unsupported, "this does not begin like an MCAP file", place,
                fmt::format("If it is a damaged MCAP file, `waymark recover {}` saves its intact part.",
                            place.source));
  return fail(ErrorCode::Unsupported, "this is not a recording of a supported format", place,
              fmt::format("Known: {}.", known_formats()));
}

/// A recording unpacked from a compressed file.
class UnpackedLog final : public MessageLog {
 public:
  UnpackedLog(std::unique_ptr<MessageLog> log, Packing packing, std::optional<Error> damage,
              std::uint64_t packed_bytes)
      : log_(std::move(log)), packing_(packing), damage_(std::move(damage)), packed_bytes_(packed_bytes) {}

  LogFormat format() const override { return log_->format(); }
  std::string description() const override {
    return fmt::format("{}, {} around the file", log_->description(), to_string(packing_));
  }
  const std::vector<LogChannel>& channels() const override { return log_->channels(); }
  LogSummary summary() const override {
    LogSummary summary = log_->summary();
    summary.size_bytes = packed_bytes_;
    return summary;
  }
  Status visit(const LogSelection& selection, const Visitor& visit) override {
    return log_->visit(selection, visit);
  }
  Status visit_as_written(const Visitor& visit) override { return log_->visit_as_written(visit); }
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    return log_->visit_samples(selection, visit);
  }
  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& choice) override {
    Result<RecordingSetup> setup = log_->setup(choice);
    if (setup && damage_) setup->problems.insert(setup->problems.begin(), *damage_);
    return setup;
  }
  Result<std::map<std::string, std::map<std::string, std::string>>> metadata() override {
    return log_->metadata();
  }
  std::vector<LogAttachment> attachments() const override { return log_->attachments(); }
  Status visit_attachments(const std::function<Status(const Attachment&)>& visit) override {
    return log_->visit_attachments(visit);
  }
  std::vector<LogProblem> problems() const override {
    std::vector<LogProblem> all = log_->problems();
    if (damage_) all.insert(all.begin(), {LogProblem::Kind::Damage, "file.packing", *damage_, 1});
    return all;
  }

 private:
  std::unique_ptr<MessageLog> log_;
  Packing packing_;
  std::optional<Error> damage_;
  std::uint64_t packed_bytes_;
};

/// Wraps a recording from a compressed file, adding the compression to its description and the damage found
/// in it to its problems.
std::unique_ptr<MessageLog> with_packing(std::unique_ptr<MessageLog> log, Packing packing,
                                         const std::optional<Error>& damage, std::uint64_t packed_bytes) {
  return std::make_unique<UnpackedLog>(std::move(log), packing, damage, packed_bytes);
}

/// Number of bytes at the beginning of a file from which its format is recognised.
constexpr std::size_t kHeadBytes = std::size_t{1} << 16U;

/// The first bytes of a file, at most kHeadBytes.
Result<Bytes> head_of(const ByteSource& source) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  Bytes head(static_cast<std::size_t>(std::min<std::uint64_t>(*size, kHeadBytes)));
  if (Status status = source.read(0, head); !status) return tl::unexpected(status.error());
  return head;
}

}  // namespace

std::string_view to_string(LogFormat format) { return row_of(format).name; }

bool gives_samples(LogFormat format) { return row_of(format).samples; }

std::string to_string(const LogProblem& problem) {
  return to_string(problem.error) + (problem.count > 1 ? fmt::format(" ({} times)", problem.count) : "");
}

LogSelection MessageLog::topics_used(const RecordingSetup& setup, std::optional<bool> images) const {
  LogSelection selection{.odometry_frames = setup.chosen.odometry_frames.value_or(OdometryFrames{})};
  for (const LogChannel& channel : channels()) {
    const bool image = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
    if (image == images.value_or(image) && !setup.chosen.unused.contains(channel.topic))
      selection.topics.insert(channel.topic);
  }
  return selection;
}

bool has_odometry_messages(const MessageLog& log) {
  const auto has_odometry = [](const LogChannel& channel) {
    const bool ros = channel.type == ros2::Odometry::kType && !channel.topic.starts_with("/truth/");
    const bool table = channel.encoding == "csv" && channel.topic == "/odom";
    const bool mbot = channel.encoding == "lcm" && channel.topic.find("ODOM") != std::string::npos;
    return (ros || table || mbot) && channel.messages.value_or(1) > 0;
  };
  return std::ranges::any_of(log.channels(), has_odometry);
}

std::uint64_t recording_start_ns(MessageLog& log) {
  constexpr std::uint64_t kBeginning_ns = 10'000'000'000;
  const std::uint64_t start = log.summary().start.value_or(0);
  if (start > 0) return start;
  std::optional<std::uint64_t> next;
  // The first message is enough, and returning an error from the visitor ends the visit.
  (void)log.visit({.from = 1}, [&](const LogChannel&, const LogMessage& message) -> Status {
    next = message.log_time;
    return fail(ErrorCode::LimitExceeded, "the first message is enough");
  });
  return next && *next > kBeginning_ns ? *next : start;
}

Result<std::unique_ptr<MessageLog>> open_log(std::unique_ptr<ByteSource> source, const LogOptions& options) {
  Result<Bytes> head = head_of(*source);
  if (!head) return tl::unexpected(head.error());
  const Packing packing = packing_of(*head);
  if (packing == Packing::None) return open_by_format(std::move(source), *head, options);

  Result<UnpackedFile> unpacked = unpack_file(*source, packing, options.unpack);
  if (!unpacked) return tl::unexpected(unpacked.error());
  head = head_of(*unpacked->source);
  if (!head) return tl::unexpected(head.error());
  if (head->empty() && unpacked->damage) {
    unpacked->damage->hint =
        "No data could be unpacked: no block of the compressed file is complete. Copy it again.";
    return tl::unexpected(*unpacked->damage);
  }
  Result<std::unique_ptr<MessageLog>> log = open_by_format(std::move(unpacked->source), *head, options);
  if (!log) return log;
  return with_packing(std::move(*log), packing, unpacked->damage, source->size().value_or(0));
}

Result<std::unique_ptr<MessageLog>> open_log(const std::filesystem::path& path, const LogOptions& options) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return open_bag_folder(path, options);
  if (path.filename() == "metadata.yaml") return open_bag_folder(path.parent_path(), options);
  Result<std::unique_ptr<ByteSource>> source = open_file(path);
  if (!source) return tl::unexpected(source.error());
  const Result<Bytes> head = head_of(**source);
  if (head && begins_as_sqlite(*head)) return open_rosbag2_file(path, path.string(), false, options);
  return open_log(std::move(*source), options);
}

std::optional<LogFormat> format_of_head(ByteSpan head, std::uint64_t size) {
  const auto row = std::ranges::find_if(kFormats, [&](const FormatRow& one) {
    return one.certain && one.begins != nullptr && one.begins(head, size);
  });
  return row == kFormats.end() ? std::nullopt : std::optional(row->format);
}

}  // namespace waymark
