#include "algorithms/core/shown.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace shown_test {

TEST(Shown, KeepsWhatCanBeShown) {
  EXPECT_EQ(shown("plain words"), "plain words");
  EXPECT_EQ(shown("Größe 8³ 世界 🙂"), "Größe 8³ 世界 🙂");
  EXPECT_EQ(shown(""), "");
}

TEST(Shown, TakesControlFromTheTerminal) {
  EXPECT_EQ(shown("\x1b[31mred\x07"), "?[31mred?");
  EXPECT_EQ(shown("\xc2\x9b"
                  "31m"),
            "?31m");  // U+009B begins such a sequence, too
  EXPECT_EQ(shown("a\r\n\tb   c"), "a b c");
  EXPECT_EQ(shown(std::string("a\0b\x7f", 4)), "a?b?");
}

TEST(Shown, WhatIsNoUtf8IsAQuestionMark) {
  EXPECT_EQ(shown("\xff\xfe"), "??");
  EXPECT_EQ(shown("\xe4\xb8"), "??");            // cut off
  EXPECT_EQ(shown("\xc0\xaf"), "??");            // longer than need be
  EXPECT_EQ(shown("\xed\xa0\x80"), "???");       // half a pair
  EXPECT_EQ(shown("\xf4\x90\x80\x80"), "????");  // beyond the last character
}

TEST(Shown, IsCutBetweenCharacters) {
  EXPECT_EQ(shown(std::string(1000, 'x'), 10), "xxxxxxxxxx...");
  EXPECT_EQ(shown("aü" + std::string(20, 'x'), 2), "a...");
  EXPECT_EQ(shown("begin " + std::string(1000, 'x') + " end", 8, true), "begi... end");
}

}  // namespace shown_test
}  // namespace hermesh
