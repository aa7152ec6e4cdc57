#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/fields.hpp"

/// Option structs with every type of field, and a file that sets some of them.
namespace waymark::test {

struct Inner {
  double noise = 0.1;
  bool on = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.noise, Field{"noise", "Noise.", 0, 1});
    visit(self.on, Field{"on", "Whether at all."});
  }
};

struct Outer {
  double reach_m = 0.5;
  int count = 3;
  std::string word = "yes";
  std::vector<std::string> names = {};
  Inner motion = {};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.reach_m, Field{"reach_m", "Reach.", 0, 10});
    visit(self.count, Field{"count", "How many.", 1, 9});
    visit(self.word, Field{"word", "Any word."});
    visit(self.names, Field{"names", "A list."});
    visit(self.motion, Field{"motion", "Noise of the motion."});
  }
};

class OptionFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() /
            ("nested-options-" +
             std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".yaml");
  }
  void TearDown() override { std::filesystem::remove(path_); }
  std::string write(const std::string& text) {
    std::ofstream(path_) << text;
    return path_.string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace waymark::test
