#include "waymark/robots/watchdog/pipes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

extern char** environ;  // NOLINT(readability-redundant-declaration): POSIX has it in no header

namespace waymark {

Duration steady_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    close();
    number_ = other.release();
  }
  return *this;
}

int Descriptor::release() { return std::exchange(number_, -1); }

void Descriptor::close() {
  if (open()) ::close(release());
}

void never_wait(int descriptor) {
  const int flags = fcntl(descriptor, F_GETFL);
  if (flags >= 0)
    (void)fcntl(descriptor, F_SETFL, static_cast<int>(static_cast<unsigned>(flags) | O_NONBLOCK));
}

Moved read_some(int descriptor, std::string& bytes) {
  std::array<char, std::size_t{1} << 16U> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init)
  ssize_t count = 0;
  do {
    count = ::read(descriptor, buffer.data(), buffer.size());
  } while (count < 0 && errno == EINTR);
  if (count > 0) {
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
    return Moved::Some;
  }
  return count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK) ? Moved::Nothing : Moved::Ended;
}

Moved write_some(int descriptor, std::string_view bytes, std::size_t& written) {
  ssize_t count = 0;
  do {
    count = ::write(descriptor, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  written = count > 0 ? static_cast<std::size_t>(count) : 0;
  if (count >= 0) return Moved::Some;
  return errno == EAGAIN || errno == EWOULDBLOCK ? Moved::Nothing : Moved::Ended;
}

bool all_read(int descriptor) {
  int unread = 0;
  return ioctl(descriptor, FIONREAD, &unread) != 0 || unread == 0;
}

namespace {

struct Pipe {
  Descriptor out;
  Descriptor in;
};

std::optional<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe(ends.data()) != 0) return std::nullopt;
  for (const int end : ends) (void)fcntl(end, F_SETFD, FD_CLOEXEC);
  return Pipe{Descriptor(ends[0]), Descriptor(ends[1])};
}

/// Restores the default handling of signals that this process ignores.
void set_signals(posix_spawnattr_t& attributes) {
  sigset_t usual;
  sigemptyset(&usual);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGQUIT, SIGXFSZ}) sigaddset(&usual, signal);
  posix_spawnattr_setsigdefault(&attributes, &usual);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF));
}

}  // namespace

Result<Spawned> spawn(const std::vector<std::string>& words) {
  auto to = make_pipe();
  auto from = make_pipe();
  if (!to || !from)
    return fail(ErrorCode::LimitExceeded, std::string("cannot make a pipe: ") + std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, to->out.number(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, from->in.number(), STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  set_signals(attributes);
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_t pid = -1;
  const int error =
      posix_spawn(&pid, words.front().c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0)
    return fail(ErrorCode::NotFound, std::string("cannot start the program: ") + std::strerror(error),
                {.source = words.front()});
  never_wait(to->in.number());
  never_wait(from->out.number());
  return Spawned{pid, std::move(to->in), std::move(from->out)};
}

std::optional<int> wait_status(pid_t pid) {
  int status = 0;
  pid_t ended = 0;
  do {
    ended = waitpid(pid, &status, WNOHANG);
  } while (ended < 0 && errno == EINTR);
  if (ended == 0) return std::nullopt;
  return ended == pid ? status : 0;  // another thread has already collected the status
}

int exit_code_of(int wait_status) {
  return WIFSIGNALED(wait_status) ? 128 + WTERMSIG(wait_status) : WEXITSTATUS(wait_status);
}

std::string ending_words(int exit_code) {
  constexpr int kSignalBase = 128;
  if (exit_code > kSignalBase)
    return fmt::format("signal {} ({})", exit_code - kSignalBase, strsignal(exit_code - kSignalBase));
  return fmt::format("exit code {}", exit_code);
}

void LineSplitter::add(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view piece = bytes.substr(0, end);
    const std::size_t room = longest_ - std::min(longest_, partial_.size());
    too_long_ = too_long_ || piece.size() > room;
    partial_.append(piece.substr(0, room));
    if (end == std::string_view::npos) return;
    ready_.push_back({++lines_, std::exchange(partial_, {}), std::exchange(too_long_, false)});
    bytes.remove_prefix(end + 1);
  }
}

std::optional<Line> LineSplitter::next() {
  if (ready_.empty()) return std::nullopt;
  Line line = std::move(ready_.front());
  ready_.pop_front();
  return line;
}

std::optional<Line> LineSplitter::rest() {
  if (partial_.empty() && !too_long_) return std::nullopt;
  return Line{++lines_, std::exchange(partial_, {}), std::exchange(too_long_, false)};
}

void LineQueue::push(std::string line) {
  bytes_ += line.size();
  lines_.push_back(std::move(line));
  // The first line may already be partly written, so it must be kept.
  while (bytes_ > max_bytes_ && lines_.size() > 2) {
    const auto oldest = lines_.begin() + 1;
    bytes_ -= oldest->size();
    lines_.erase(oldest);
    ++dropped_;
  }
}

void LineQueue::pop(std::size_t bytes) {
  written_ += bytes;
  if (written_ < lines_.front().size()) return;
  bytes_ -= lines_.front().size();
  written_ = 0;
  lines_.pop_front();
}

}  // namespace waymark
