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

constexpr const char* kExtension = ".stop";

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

/// Whether the folder belongs to this user, is not a link, and is not accessible to other users.
bool is_ours(const fs::path& folder) {
  struct stat info {};
  constexpr mode_t kOthers = 077;
  return ::lstat(folder.c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == ::geteuid() &&
         (info.st_mode & kOthers) == 0;
}

/// A connection that is waiting for an answer.
struct StopRequest {
  fs::path path;
  Descriptor socket;
  std::string answer{};
  bool over = false;
};

/// Connects to a socket. `nullopt` if no process is listening; the socket is then removed.
std::optional<StopRequest> request_stop(const fs::path& path) {
  const auto address = address_of(path);
  StopRequest asked{path, unix_socket()};
  if (!address || !asked.socket.open()) return std::nullopt;
  if (::connect(asked.socket.number(), generic(*address), sizeof *address) == 0) return asked;
  if (errno == ECONNREFUSED) ::unlink(path.c_str());
  if (errno != EAGAIN) return std::nullopt;  // EAGAIN means that its queue is full, so it does not answer
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
    return fail(ErrorCode::Unwritable, "cannot create the folder for `waymark stop`: " + reason(),
                {.source = folder.string()}, "Set XDG_RUNTIME_DIR to a folder of your own.");
  if (is_ours(folder)) return folder;
  return fail(ErrorCode::Unwritable,
              "the folder for `waymark stop` belongs to another user or is accessible to other users",
              {.source = folder.string()},
              "Set XDG_RUNTIME_DIR to a folder of your own, or remove this one.");
}

Result<std::unique_ptr<StopSocket>> StopSocket::open(const fs::path& folder, std::string name,
                                                     std::function<void()> on_stop) {
  std::unique_ptr<StopSocket> made(new StopSocket);
  made->path_ = folder / fmt::format("{}{}", ::getpid(), kExtension);
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
  ::unlink(made->path_.c_str());  // left over from an earlier process with the same id
  constexpr int kWaiting = 16;
  if (!made->socket_.open() || ::bind(made->socket_.number(), generic(*address), sizeof *address) != 0 ||
      ::listen(made->socket_.number(), kWaiting) != 0) {
    made->path_.clear();
    return fail(ErrorCode::Unwritable, "`waymark stop` cannot reach this drive: " + reason(),
                {.source = folder.string()});
  }
  sigset_t all;
  sigset_t before;
  sigfillset(&all);  // the driving thread handles signals
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
      constexpr int kRetryPeriod_ms = 20;
      (void)::poll(&fds[1], 1, kRetryPeriod_ms);  // out of file descriptors; try again
      continue;
    }
    on_stop_();
    (void)::send(client.number(), answer_.data(), answer_.size(), MSG_NOSIGNAL);
  }
}

std::vector<StopAnswer> stop_all(const fs::path& folder, Duration patience) {
  const Duration deadline = steady_now() + patience;
  std::vector<StopRequest> requests;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (entry.path().extension() != kExtension) continue;
    if (auto one = request_stop(entry.path())) requests.push_back(std::move(*one));
  }
  const auto is_pending = [](const StopRequest& one) { return !one.over; };
  while (std::ranges::any_of(requests, is_pending) && steady_now() < deadline) {
    for (StopRequest& one : requests) {
      if (!one.over && read_some(one.socket.number(), one.answer) == Moved::Ended) one.over = true;
    }
    constexpr int kPollPeriod_ms = 5;
    (void)::poll(nullptr, 0, kPollPeriod_ms);
  }
  std::vector<StopAnswer> answers;
  for (const StopRequest& one : requests) {
    const bool answered = one.answer.ends_with('\n');
    answers.push_back(
        {answered ? one.answer.substr(0, one.answer.size() - 1) : one.path.filename().string(), answered});
  }
  return answers;
}

}  // namespace waymark
