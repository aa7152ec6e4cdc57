#include "waymark/robots/watchdog/stop_socket.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".stop";

std::string reason() { return std::strerror(errno); }  // NOLINT(concurrency-mt-unsafe)

std::optional<sockaddr_un> address_of(const fs::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& text = path.native();
  if (text.size() >= sizeof address.sun_path) return std::nullopt;
  std::ranges::copy(text, static_cast<char*>(address.sun_path));
  return address;
}

const sockaddr* generic(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

Descriptor unix_socket() {
  return Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}

/// Of this user alone: a folder, not a link to one, that nobody else may enter.
bool is_ours(const fs::path& folder) {
  struct stat info {};
  constexpr mode_t kOthers = 077;
  return ::lstat(folder.c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == ::geteuid() &&
         (info.st_mode & kOthers) == 0;
}

/// A connection that waits for its answer.
struct Asked {
  fs::path path;
  Descriptor socket;
  std::string words{};
  bool over = false;
};

/// Nothing where nobody listens: then the socket is removed.
std::optional<Asked> ask(const fs::path& path) {
  const auto address = address_of(path);
  Asked asked{path, unix_socket()};
  if (!address || !asked.socket.open()) return std::nullopt;
  if (::connect(asked.socket.number(), generic(*address), sizeof *address) == 0) return asked;
  if (errno == ECONNREFUSED) ::unlink(path.c_str());
  if (errno != EAGAIN) return std::nullopt;  // EAGAIN: it is asked from everywhere and answers nobody
  asked.over = true;
  return asked;
}

}  // namespace

Result<fs::path> stop_folder() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");  // NOLINT(concurrency-mt-unsafe)
  const fs::path folder = runtime != nullptr && *runtime == '/'
                              ? fs::path(runtime) / "waymark"
                              : fs::path(fmt::format("/tmp/waymark-{}", ::geteuid()));
  constexpr mode_t kOnlyUs = 0700;
  if (::mkdir(folder.c_str(), kOnlyUs) != 0 && errno != EEXIST)
    return fail(ErrorCode::Unwritable, "cannot make the folder for `waymark stop`: " + reason(),
                {.source = folder.string()}, "Set XDG_RUNTIME_DIR to a folder of yours.");
  if (is_ours(folder)) return folder;
  return fail(ErrorCode::Unwritable,
              "the folder for `waymark stop` belongs to somebody else, or others may enter it",
              {.source = folder.string()}, "Set XDG_RUNTIME_DIR to a folder of yours, or remove this one.");
}

Result<std::unique_ptr<StopSocket>> StopSocket::open(const fs::path& folder, std::string name,
                                                     std::function<void()> on_stop) {
  std::unique_ptr<StopSocket> made(new StopSocket);
  made->path_ = folder / fmt::format("{}{}", ::getpid(), kEnding);
  made->answer_ = fmt::format("{} (process {})\n", name, ::getpid());
  made->on_stop_ = std::move(on_stop);
  made->socket_ = unix_socket();
  const auto address = address_of(made->path_);
  std::array<int, 2> ends{};
  if (!address || ::pipe2(ends.data(), O_CLOEXEC) != 0)
    return fail(ErrorCode::Unwritable, "`waymark stop` cannot reach this drive: " + reason(),
                {.source = made->path_.string()});
  made->end_ = Descriptor(ends[0]);
  made->over_ = Descriptor(ends[1]);
  ::unlink(made->path_.c_str());  // of a process that had our number before
  constexpr int kWaiting = 16;
  if (!made->socket_.open() || ::bind(made->socket_.number(), generic(*address), sizeof *address) != 0 ||
      ::listen(made->socket_.number(), kWaiting) != 0) {
    made->path_.clear();
    return fail(ErrorCode::Unwritable, "`waymark stop` cannot reach this drive: " + reason(),
                {.source = folder.string()});
  }
  sigset_t all;
  sigset_t before;
  sigfillset(&all);  // signals are for the thread that drives
  pthread_sigmask(SIG_SETMASK, &all, &before);
  made->thread_ = std::thread([socket = made.get()] { socket->listen(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return made;
}

StopSocket::~StopSocket() {
  over_.close();
  if (thread_.joinable()) thread_.join();
  if (!path_.empty()) ::unlink(path_.c_str());
}

void StopSocket::listen() {
  while (true) {
    std::array<pollfd, 2> fds{{{socket_.number(), POLLIN, 0}, {end_.number(), POLLIN, 0}}};
    if (::poll(fds.data(), fds.size(), -1) < 0) continue;
    if (fds[1].revents != 0) return;
    const Descriptor client(::accept4(socket_.number(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!client.open()) {
      constexpr int kBreath_ms = 20;
      (void)::poll(&fds[1], 1, kBreath_ms);  // no descriptor is free just now
      continue;
    }
    on_stop_();
    (void)::send(client.number(), answer_.data(), answer_.size(), MSG_NOSIGNAL);
  }
}

std::vector<StopAnswer> stop_all(const fs::path& folder, Duration patience) {
  const Duration deadline = steady_now() + patience;
  std::vector<Asked> asked;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.path().extension() != kEnding) continue;
    if (auto one = ask(entry.path())) asked.push_back(std::move(*one));
  }
  const auto waits = [](const Asked& one) { return !one.over; };
  while (std::ranges::any_of(asked, waits) && steady_now() < deadline) {
    for (Asked& one : asked) {
      if (!one.over && read_some(one.socket.number(), one.words) == Moved::Ended) one.over = true;
    }
    constexpr int kBetween_ms = 5;
    (void)::poll(nullptr, 0, kBetween_ms);
  }
  std::vector<StopAnswer> answers;
  for (const Asked& one : asked) {
    const bool answered = one.words.ends_with('\n');
    answers.push_back(
        {answered ? one.words.substr(0, one.words.size() - 1) : one.path.filename().string(), answered});
  }
  return answers;
}

}  // namespace waymark
