#include "algorithms/core/option_table.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "algorithms/core/error.h"

namespace hermesh {
namespace option_table_test {

struct Settings {
  enum class Shape { round, square };
  Shape shape = Shape::square;
  double width = 0.25;
  std::uint64_t seed = 7;
  bool closed = true;
};

OptionTable<Settings> table() {
  return OptionTable<Settings>()
      .choice("shape", &Settings::shape,
              {{"round", Settings::Shape::round}, {"square", Settings::Shape::square}}, "a shape")
      .number("width", &Settings::width, {.maximum = 2.0}, "a width", {"shape=square"})
      .number("seed", &Settings::seed, {.maximum = 1e15}, "a seed")
      .choice("closed", &Settings::closed, {{"true", true}, {"false", false}}, "whether it is closed");
}

TEST(OptionTable, DefaultsAreThoseOfTheMembers) {
  const std::vector<OptionSpec> specs = table().specs();
  ASSERT_EQ(specs.size(), 4u);
  EXPECT_EQ(specs[0].fallback, "square");
  EXPECT_EQ(specs[0].choices, (std::vector<std::string>{"round", "square"}));
  EXPECT_EQ(specs[1].fallback, "0.25");
  EXPECT_EQ(specs[1].minimum, 0.0);
  EXPECT_EQ(specs[1].maximum, 2.0);
  EXPECT_EQ(specs[1].only_with, std::vector<std::string>{"shape=square"});
  EXPECT_EQ(specs[2].fallback, "7");
  EXPECT_EQ(specs[3].fallback, "true");
  const Settings settings = table().read(Options("toy", specs, {}));
  EXPECT_EQ(settings.shape, Settings::Shape::square);
  EXPECT_EQ(settings.width, 0.25);
  EXPECT_EQ(settings.seed, 7u);
  EXPECT_TRUE(settings.closed);
}

TEST(OptionTable, GivenValuesSetTheirMembersAlone) {
  const auto read = [](const std::map<std::string, std::string>& given) {
    return table().read(Options("toy", table().specs(), given));
  };
  EXPECT_EQ(read({{"shape", "round"}}).shape, Settings::Shape::round);
  EXPECT_EQ(read({{"width", "1.5"}}).width, 1.5);
  EXPECT_EQ(read({{"seed", "999999999999999"}}).seed, 999999999999999u);
  EXPECT_FALSE(read({{"closed", "false"}}).closed);
  EXPECT_EQ(read({{"closed", "false"}}).seed, 7u);
  EXPECT_THROW(read({{"width", "2.5"}}), Error);
  EXPECT_THROW(read({{"seed", "1.5"}}), Error);
  EXPECT_THROW(read({{"shape", "flat"}}), Error);
  EXPECT_THROW(read({{"shape", "round"}, {"width", "1"}}), Error);
}

TEST(OptionTable, AnOptionLeftOutKeepsItsDefault) {
  const OptionTable<Settings> fewer = table().without("width");
  EXPECT_EQ(fewer.specs().size(), 3u);
  EXPECT_EQ(fewer.read(Options("toy", fewer.specs(), {{"seed", "1"}})).width, 0.25);
  EXPECT_THROW(fewer.read(Options("toy", {}, {})), std::logic_error);
}

TEST(OptionTable, ADefaultWithoutANameIsRefused) {
  EXPECT_THROW(OptionTable<Settings>().choice("closed", &Settings::closed, {{"false", false}}, ""),
               std::logic_error);
}

}  // namespace option_table_test
}  // namespace hermesh
