#include "waymark/app/live/inputs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/app/live/robot_setup.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

TEST(Inputs, RejectsAnUnknownDriver) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  for (const auto& error : {make_lap_driver("scriptet", 0.3, setup).error(),
                            make_operator_input("scriptet", 0.3, setup).error()}) {
    EXPECT_EQ(error.code, ErrorCode::InvalidArgument);
    EXPECT_EQ(error.place.key, "driver");
    EXPECT_THAT(error.hint, HasSubstr("scripted"));
  }
}

TEST(Inputs, EveryNameMakesAnInputOrAnError) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  for (const std::string& name : lap_drivers()) {
    const auto driver = make_lap_driver(name, 0.3, setup);
    if (!driver) EXPECT_FALSE(driver.error().message.empty()) << name;
    if (name == "scripted") EXPECT_TRUE(driver) << to_string(driver.error());
  }
  for (const std::string& name : operator_inputs()) {
    const auto input = make_operator_input(name, 0.3, setup);
    if (!input && name != "page") EXPECT_NE(input.error().place.key, "driver") << name << " is unknown";
  }
  EXPECT_TRUE(make_operator_input("lines", 0.3, setup));
}

TEST(Inputs, AScriptNeedsAWorldWithAPath) {
  const SimulatedSetup nowhere = load_setup("", "", 1)->simulated;
  EXPECT_FALSE(make_lap_driver("scripted", 0.3, nowhere));
  EXPECT_FALSE(make_operator_input("scripted", 0.3, nowhere));
}

TEST(Inputs, ThePageNeedsViewers) {
  const SimulatedSetup setup = load_setup("circuit24", "", 1)->simulated;
  EXPECT_FALSE(viewer_link(nullptr)) << "without a feed there are no viewers";
  const auto alone = make_operator_input("page", 0.3, setup);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().place.key, "driver");
  EXPECT_THAT(alone.error().hint, HasSubstr("`view`"));
  testing::expect_on_page("live", alone.error());
  const ViewerLink viewers;
  EXPECT_TRUE(make_operator_input("page", 0.3, setup, viewers));
  EXPECT_TRUE(make_operator_input("scripted", 0.3, setup, viewers)) << "the page has the buttons as well";
}

TEST(StopKey, IsNeverPressedIfTheDriverReadsTheKeys) {
  StopKey taken(true);
  EXPECT_FALSE(taken.watched());
  EXPECT_FALSE(taken.pressed());
}

}  // namespace
}  // namespace waymark
