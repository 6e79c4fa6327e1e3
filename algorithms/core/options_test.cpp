#include "algorithms/core/options.h"

#include <gtest/gtest.h>

#include "algorithms/core/error.h"

namespace hermesh {
namespace options_test {

const std::vector<OptionSpec> declared = {
    {.name = "threshold", .fallback = "0.10", .help = "", .choices = {}, .minimum = 0.0, .maximum = 1.0},
    {.name = "placement", .fallback = "optimal", .help = "", .choices = {"optimal", "average"}},
    {.name = "budget", .fallback = "1e3", .help = "", .choices = {}, .minimum = 1.0},
};

std::string error_of(const std::map<std::string, std::string>& given) {
  try {
    Options("dual-contouring", declared, given);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Options, FillsInWhatIsMissing) {
  const Options options("dual-contouring", declared, {{"placement", "average"}});
  EXPECT_EQ(options.text("placement"), "average");
  EXPECT_EQ(options.number("threshold"), 0.1);
  EXPECT_EQ(options.number("budget"), 1000.0);
}

TEST(Options, CanonicalIsAlphabeticalAndDoesNotDependOnSpelling) {
  const Options one("dual-contouring", declared, {{"threshold", "0.50"}});
  const Options two("dual-contouring", declared, {{"threshold", "5e-1"}, {"budget", "1000"}});
  EXPECT_EQ(one.canonical(), "budget=1000 placement=optimal threshold=0.5");
  EXPECT_EQ(one.canonical(), two.canonical());
  EXPECT_EQ(Options().canonical(), "");
}

TEST(Options, RefusalsNameVariantOptionAndWhatIsAllowed) {
  EXPECT_EQ(error_of({{"colour", "1"}}),
            "dual-contouring has no option 'colour'; it takes threshold, placement, budget");
  EXPECT_EQ(error_of({{"placement", "best"}}),
            "option 'placement' of dual-contouring cannot be 'best'; it takes one of: optimal, average");
  EXPECT_EQ(error_of({{"threshold", "2"}}),
            "option 'threshold' of dual-contouring cannot be '2'; it takes a number from 0 to 1");
  EXPECT_EQ(error_of({{"budget", "0"}}),
            "option 'budget' of dual-contouring cannot be '0'; it takes a number of at least 1");
  for (const char* bad : {"", "abc", "0.5x", "nan", "inf", "0,5", " 0.5"})
    EXPECT_NE(error_of({{"threshold", bad}}), "") << bad;
}

TEST(Options, AnOptionThatHasNoEffectBesideTheOthersIsRefused) {
  const std::vector<OptionSpec> specs = {
      {.name = "kind", .fallback = "plain", .help = "", .choices = {"plain", "packed", "fixed"}},
      {.name = "code",
       .fallback = "a",
       .help = "",
       .choices = {"a", "b"},
       .only_with = {"kind=packed|fixed"}},
      {.name = "world", .fallback = "0", .help = ""},
      {.name = "voxels", .fallback = "1", .help = "", .only_with = {"world=0", "kind=plain"}}};
  const auto error = [&](const std::map<std::string, std::string>& given) {
    try {
      Options("it", specs, given);
      return std::string();
    } catch (const Error& e) {
      return std::string(e.what());
    }
  };
  EXPECT_EQ(error({}), "");
  EXPECT_EQ(error({{"kind", "packed"}, {"code", "b"}}), "");
  EXPECT_EQ(error({{"kind", "fixed"}, {"code", "a"}}), "");
  EXPECT_EQ(error({{"code", "a"}}), "option 'code' of it has no effect without kind=packed or fixed");
  EXPECT_EQ(error({{"voxels", "2"}, {"world", "0.0"}}), "");
  EXPECT_EQ(error({{"voxels", "2"}, {"world", "3"}}), "option 'voxels' of it has no effect without world=0");
  EXPECT_EQ(error({{"voxels", "2"}, {"kind", "fixed"}}),
            "option 'voxels' of it has no effect without kind=plain");
}

TEST(Options, AVariantWithoutOptionsTakesNone) {
  EXPECT_THROW(Options("marching-cubes", {}, {{"a", "1"}}), Error);
  EXPECT_NO_THROW(Options("marching-cubes", {}, {}));
}

TEST(ParseOption, SplitsAtTheFirstEqualsSign) {
  EXPECT_EQ(parse_option("a=b=c"), std::pair(std::string("a"), std::string("b=c")));
  EXPECT_EQ(parse_option("a="), std::pair(std::string("a"), std::string()));
  EXPECT_THROW(parse_option("a"), Error);
  EXPECT_THROW(parse_option("=b"), Error);
  EXPECT_THROW(parse_option(""), Error);
}

}  // namespace options_test
}  // namespace hermesh
