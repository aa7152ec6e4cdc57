#include "waymark/recording/csv_log.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/csv_table.hpp"
#include "waymark/recording/csv_text.hpp"
#include "waymark/recording/log_problems.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxLine = 1 << 20;

class CsvLog final : public MessageLog {
 public:
  CsvLog(std::unique_ptr<ByteSource> source, std::uint64_t size, csv::Header header, std::string_view names)
      : source_(std::move(source)), size_(size), header_(std::move(header)) {
    channels_.push_back({.topic = std::string(csv::topic_of(header_.kind())),
                         .type = fmt::format("csv/{}", csv::name_of(header_.kind())),
                         .encoding = "csv",
                         .schema_encoding = "csv",
                         .schema = std::string(names),
                         .messages = 0});
    std::optional<std::uint64_t> last;
    LogProblems& problems = opened_;
    (void)visit_rows({}, problems, [&](std::int64_t time, const csv::Line& line, const auto&) -> Status {
      const std::uint64_t log_time = clamped(time);
      ++*channels_[0].messages;
      if (last && log_time < *last)
        problems.trap("csv.time_back", [&] {
          return Error{ErrorCode::Unreadable,
                       "time goes back here: rows stay in the order of the file",
                       place(line),
                       {}};
        });
      last = log_time;
      start_ = std::min(start_.value_or(log_time), log_time);
      end_ = std::max(end_.value_or(log_time), log_time);
      return {};
    });
  }

  LogFormat format() const override { return LogFormat::Csv; }
  std::string description() const override { return fmt::format("CSV, {}", csv::name_of(header_.kind())); }
  const std::vector<LogChannel>& channels() const override { return channels_; }
  LogSummary summary() const override {
    return {.start = start_,
            .end = end_,
            .messages = channels_[0].messages,
            .size_bytes = size_,
            .files = {source_->name()}};
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    LogProblems known;
    return visit_rows(selection, known, [&](std::int64_t time, const csv::Line& line, const auto&) {
      return visit(channels_[0], {clamped(time), clamped(time), as_bytes(line.text)});
    });
  }

  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    visited_.clear();
    LogProblems known;
    csv::Rows rows(header_, visited_, visit);
    Status status = visit_rows(selection, known,
                               [&](std::int64_t time, const csv::Line& line, const auto& cells) -> Status {
                                 const Result<bool> taken = rows.add(time, cells);
                                 if (!taken) return tl::unexpected(taken.error());
                                 if (!*taken) note_row(line, visited_);
                                 return {};
                               });
    return status ? rows.finish() : status;
  }

  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& /*choice*/) override {
    RecordingSetup setup;
    for (const LogProblem& problem : problems()) setup.problems.push_back(problem.error);
    return setup;
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  static std::uint64_t clamped(std::int64_t time) {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, time));
  }
  [[nodiscard]] Place place(const csv::Line& line) const {
    return {.source = source_->name(), .line = line.number, .byte = static_cast<std::int64_t>(line.offset)};
  }
  void note_row(const csv::Line& line, LogProblems& problems) const {
    problems.damage("csv.row", [&] {
      return Error{ErrorCode::Unreadable,
                   "a row whose cells are not what its columns say: passed over",
                   place(line),
                   {}};
    });
  }

  template <class Visit>
  Status visit_rows(const LogSelection& selection, LogProblems& problems, const Visit& visit) {
    if (!selection.takes(channels_[0].topic)) return {};
    csv::LineReader lines(*source_, size_, kMaxLine);
    std::vector<std::string_view> cells;
    (void)lines.next();  // the names
    while (const auto line = lines.next()) {
      if (line->text.empty() || line->text.starts_with('#')) continue;
      csv::split(line->text, cells);
      const auto time = cells.size() == header_.columns() ? header_.time(cells) : std::nullopt;
      if (!time) {
        note_row(*line, problems);
        continue;
      }
      if (!selection.takes(clamped(*time))) continue;
      if (Status status = visit(*time, *line, cells); !status) return status;
    }
    return {};
  }

  std::unique_ptr<ByteSource> source_;
  std::uint64_t size_;
  csv::Header header_;
  std::vector<LogChannel> channels_;
  std::optional<std::uint64_t> start_;
  std::optional<std::uint64_t> end_;
  LogProblems opened_;
  LogProblems visited_;
};

}  // namespace

bool looks_like_csv(ByteSpan head) {
  const std::string_view text = as_text(head);
  const std::string_view line = text.substr(0, text.find('\n'));
  const bool printable = std::ranges::all_of(
      line, [](char c) { return static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\r'; });
  return printable && line.find(',') != std::string_view::npos;
}

Result<std::unique_ptr<MessageLog>> open_csv_log(std::unique_ptr<ByteSource> source,
                                                 const LogOptions& /*options*/) {
  const Result<std::uint64_t> size = source->size();
  if (!size) return tl::unexpected(size.error());
  csv::LineReader lines(*source, *size, kMaxLine);
  const auto first = lines.next();
  if (!first) return fail(ErrorCode::Unreadable, "the table is empty", {.source = source->name()});
  Result<csv::Header> header = csv::Header::parse(first->text, source->name());
  if (!header) return tl::unexpected(header.error());
  const std::string names(first->text);
  return std::make_unique<CsvLog>(std::move(source), *size, std::move(*header), names);
}

}  // namespace waymark
