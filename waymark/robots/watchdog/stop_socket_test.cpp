#include "waymark/robots/watchdog/stop_socket.hpp"

#include <atomic>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace waymark {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

class Stop : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "waymark-stop-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(Stop, ItsOwnThreadAnswersWhileOthersAreBusy) {
  std::atomic<int> stops{0};
  {
    const auto socket = StopSocket::open(folder_, "replay of map", [&] { ++stops; });
    ASSERT_TRUE(socket) << to_string(socket.error());
    for (int i = 1; i <= 3; ++i) {
      const auto answers = stop_all(folder_, seconds(20));
      ASSERT_EQ(answers.size(), 1U);
      EXPECT_TRUE(answers[0].answered);
      EXPECT_EQ(answers[0].drive, "replay of map (process " + std::to_string(getpid()) + ")");
      EXPECT_EQ(stops, i);
    }
  }
  EXPECT_TRUE(fs::is_empty(folder_)) << "the socket is removed with its drive";
  EXPECT_TRUE(stop_all(folder_, seconds(20)).empty());
}

TEST_F(Stop, RemovesTheSocketOfAProcessThatDied) {
  const pid_t pid = fork();
  if (pid == 0) {
    const auto socket = StopSocket::open(folder_, "gone", [] {});
    _exit(socket ? 0 : 1);  // exits without calling the destructor
  }
  int status = 0;
  waitpid(pid, &status, 0);
  ASSERT_EQ(status, 0);
  EXPECT_FALSE(fs::is_empty(folder_));
  EXPECT_TRUE(stop_all(folder_, seconds(20)).empty());
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(Stop, ReportsADriveThatDoesNotAnswer) {
  const pid_t pid = fork();
  if (pid == 0) {
    const auto socket = StopSocket::open(folder_, "frozen", [] {});
    raise(SIGSTOP);
    _exit(0);
  }
  int status = 0;
  waitpid(pid, &status, WUNTRACED);
  const auto answers = stop_all(folder_, std::chrono::milliseconds(100));
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_FALSE(answers[0].answered);
  EXPECT_EQ(answers[0].drive, std::to_string(pid) + ".stop");
  kill(pid, SIGKILL);
  waitpid(pid, &status, 0);
}

TEST_F(Stop, TheFolderIsAccessibleOnlyForThisUser) {
  setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
  const auto made = stop_folder();
  ASSERT_TRUE(made);
  EXPECT_EQ(*made, folder_ / "waymark");
  EXPECT_EQ(fs::status(*made).permissions(), fs::perms::owner_all);
  EXPECT_TRUE(stop_folder()) << "again";
  chmod(made->c_str(), 0777);
  EXPECT_FALSE(stop_folder());
  fs::remove(*made);
  fs::create_directory(folder_ / "elsewhere");
  fs::create_directory_symlink(folder_ / "elsewhere", *made);
  EXPECT_FALSE(stop_folder()) << "a link";
  unsetenv("XDG_RUNTIME_DIR");
}

}  // namespace
}  // namespace waymark
