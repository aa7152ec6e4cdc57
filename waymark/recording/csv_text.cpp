#include "waymark/recording/csv_text.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <span>

namespace waymark::csv {
namespace {

constexpr std::uint64_t kPiece = 1 << 18;
constexpr std::int64_t kSecond = 1'000'000'000;

template <class T>
std::optional<T> parse(std::string_view cell) {
  if (cell.starts_with('+')) cell.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

}  // namespace

bool LineReader::fill() {
  const std::uint64_t want = std::min(kPiece, size_ - read_);
  if (want == 0) return false;
  window_.erase(0, at_);
  at_ = 0;
  const std::size_t old = window_.size();
  window_.resize(old + static_cast<std::size_t>(want));
  auto* begin = reinterpret_cast<std::uint8_t*>(window_.data()) + old;
  if (!source_.read(read_, std::span(begin, static_cast<std::size_t>(want)))) {
    window_.resize(old);
    size_ = read_;
    return false;
  }
  read_ += want;
  return true;
}

void LineReader::skip_rest() {
  cut_ = false;
  do {
    const std::size_t end = window_.find('\n', at_);
    at_ = end == std::string::npos ? window_.size() : end + 1;
    if (end != std::string::npos) return;
  } while (fill());
}

std::optional<Line> LineReader::next() {
  if (cut_) skip_rest();
  std::size_t end = window_.find('\n', at_);
  while (end == std::string::npos && window_.size() - at_ <= max_line_bytes_) {
    const std::size_t seen = window_.size() - at_;
    if (!fill()) break;
    end = window_.find('\n', at_ + seen);
  }
  if (end == std::string::npos && at_ == window_.size()) return std::nullopt;
  Line line{.offset = read_ - (window_.size() - at_), .number = ++number_};
  const std::size_t whole = (end == std::string::npos ? window_.size() : end) - at_;
  cut_ = whole > max_line_bytes_;
  const std::size_t size = std::min(whole, max_line_bytes_);
  line.text = std::string_view(window_).substr(at_, size);
  at_ += size + (end == std::string::npos || cut_ ? 0 : 1);
  if (line.text.ends_with('\r')) line.text.remove_suffix(1);
  return line;
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (bool more = true; more;) {
    const std::size_t comma = line.find(',');
    more = comma != std::string_view::npos;
    std::string_view cell = line.substr(0, comma);
    if (more) line.remove_prefix(comma + 1);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
    cells.push_back(cell);
  }
}

std::optional<double> number(std::string_view cell) {
  const auto value = parse<double>(cell);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> integer(std::string_view cell) { return parse<std::int64_t>(cell); }

std::optional<std::int64_t> seconds_as_ns(std::string_view cell) {
  constexpr std::int64_t kMost = 4'000'000'000;
  const std::size_t point = std::min(cell.find('.'), cell.size());
  const auto whole = integer(cell.substr(0, point));
  std::string_view fraction = cell.substr(std::min(point + 1, cell.size()));
  const bool plain = whole && *whole <= kMost && *whole >= -kMost &&
                     std::ranges::all_of(fraction, [](char c) { return c >= '0' && c <= '9'; });
  if (plain) {
    fraction = fraction.substr(0, 9);
    std::int64_t ns = 0;
    for (std::size_t i = 0; i < 9; ++i) ns = 10 * ns + (i < fraction.size() ? fraction[i] - '0' : 0);
    return *whole * kSecond + (cell.starts_with('-') ? -ns : ns);
  }
  const auto seconds = number(cell);
  if (!seconds || std::abs(*seconds) > static_cast<double>(kMost)) return std::nullopt;
  return std::llround(*seconds * static_cast<double>(kSecond));
}

}  // namespace waymark::csv
