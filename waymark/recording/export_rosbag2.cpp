#include <fstream>

#include <fmt/format.h>

#include "waymark/recording/export_log.hpp"
#include "waymark/recording/export_progress.hpp"
#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/sqlite_bag.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

Result<ExportReport> export_to(MessageLog& log, const fs::path& path, const ExportOptions& options) {
  Result<std::unique_ptr<ByteSink>> sink = create_file(path);
  return sink ? export_mcap(log, std::move(*sink), options) : tl::unexpected(sink.error());
}

BagContents contents_of(const MessageLog& log, std::string file) {
  const LogSummary summary = log.summary();
  return {.file = std::move(file),
          .channels = log.channels(),
          .start_ns = summary.start.value_or(0),
          .end_ns = summary.end.value_or(0)};
}

Status write_text(const fs::path& path, const std::string& text) {
  const Result<std::unique_ptr<ByteSink>> sink = create_file(path);
  return sink ? (*sink)->write(as_bytes(text)) : tl::unexpected(sink.error());
}

/// A SQLite bag has no place for them.
void note_what_is_left_out(MessageLog& log, LogProblems& noted) {
  const auto setup = log.setup();
  if (log.attachments().empty() && (!setup || setup->metadata.empty())) return;
  noted.trap("rosbag2.no_metadata_blocks", [] {
    return Error{ErrorCode::Unsupported,
                 "metadata and attachments of the recording (tag size, calibration) have no place in a bag "
                 "that is stored as sqlite3: left out",
                 {},
                 "Store it as mcap to keep them."};
  });
}

Status store_as_sqlite(const fs::path& mcap, const fs::path& folder, const BagFormat& format,
                       const std::string& file, const ExportOptions& options, LogProblems& noted) {
  const Result<std::unique_ptr<MessageLog>> log = open_log(mcap);
  if (!log) return tl::unexpected(log.error());
  ExportProgress progress(**log, {.progress = options.progress});
  const BagContents contents = contents_of(**log, file);
  if (Status status = write_sqlite_bag(**log, folder / file, format, contents,
                                       [&](std::uint64_t log_time) { return progress.at(log_time); });
      !status)
    return status;
  note_what_is_left_out(**log, noted);
  return write_text(folder / "metadata.yaml", bag_metadata(format, contents));
}

}  // namespace

Result<ExportReport> export_rosbag2(MessageLog& log, const fs::path& folder, const std::string& name,
                                    const BagFormat& format, const ExportOptions& options) {
  std::error_code error;
  if (!fs::create_directory(folder, error))
    return fail(ErrorCode::Unwritable, error ? error.message() : "this folder exists already",
                {.source = folder.string()});
  const std::string file = fmt::format("{}_0{}", name, format.suffix());
  ExportOptions as_bag = options;
  as_bag.qos = format.qos();
  // As MCAP first, whatever it was: channels, their counts and times are then known before a message is
  // stored.
  const bool is_final = format.storage == BagStorage::Mcap;
  const fs::path mcap = folder / (is_final ? file : "messages.mcap");
  Result<ExportReport> report = export_to(log, mcap, as_bag);
  if (!report) return report;
  LogProblems noted;
  Status status;
  if (is_final) {
    const Result<std::unique_ptr<MessageLog>> written = open_log(mcap);
    status = written
                 ? write_text(folder / "metadata.yaml", bag_metadata(format, contents_of(**written, file)))
                 : tl::unexpected(written.error());
  } else {
    status = store_as_sqlite(mcap, folder, format, file, options, noted);
    fs::remove(mcap, error);
  }
  if (!status) return tl::unexpected(status.error());
  noted.append_to(report->problems);
  return report;
}

}  // namespace waymark
