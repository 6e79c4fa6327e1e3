// hermesh remesh --tiles and --tile, and hermesh join.

#include "experiments/cli/process_for_tests.h"

namespace hermesh::cli {
namespace cli_tiles_test {

using CliTilesTest = ProgramTest;

constexpr const char* kRemesh = "remesh sphere.off ";

TEST_F(CliTilesTest, TilesJobsAndTheWholeGiveTheSameBytes) {
  write_sphere();
  const Words whole =
      "remesh sphere.off whole.ply --resolution 100 -o tile=32 --signs winding-number --thin drop";
  run_to(0, whole);
  run_to(0, Words(kRemesh) + "tiles.ply --resolution 100 --tiles=32");
  EXPECT_TRUE(read("whole.ply") == read("tiles.ply"));
  Words join = "join";
  for (const char* job : {"3", "1", "4", "2"}) {
    run_to(0, Words(kRemesh) +
                  (std::string("part") + job + " --resolution 100 --tiles=32 --tile " + job + "/4"));
    join.push_back(std::string("part") + job);
  }
  run_to(0, join + "joined.ply");
  EXPECT_TRUE(read("whole.ply") == read("joined.ply"));
  // The output exists already.
  run_to(0, join + "joined.ply --json");
  expect_refusal(1, Words("join part1 part2 part3 out.ply"), {"4", "missing"});
  expect_refusal(1, Words("join part1 part2 part3 part3 out.ply"), {"twice"});
  expect_refusal(2, Words("join part1 part2 part3 part4 out.stl"), {"single"});
  expect_refusal(2, "join part1", {"mesh"});
  const std::string part = read("part1");
  write("cut", part.substr(0, part.size() / 2));
  expect_refusal(1, Words("join cut part2 part3 part4 out.ply"), {"cut", "truncated"});
  std::string changed = part;
  changed[part.size() / 2] = char(changed[part.size() / 2] ^ 1);
  write("changed", changed);
  expect_refusal(1, Words("join changed part2 part3 part4 out.ply"), {"changed", "damaged"});
  expect_refusal(1, Words("join sphere.off part2 part3 part4 out.ply"), {"sphere.off", "file of tiles"});
}

TEST_F(CliTilesTest, SingleFilesOfSinglePrecisionAreProvedForIt) {
  write_sphere();
  run_to(0, Words(kRemesh) + "whole.stl --resolution 60 -o tile=32 --signs winding-number --thin drop");
  run_to(0, Words(kRemesh) + "tiles.stl --resolution 60 --tiles=32");
  EXPECT_TRUE(read("whole.stl") == read("tiles.stl"));
}

TEST_F(CliTilesTest, WhatNeedsTheWholeVolumeIsRefused) {
  write_sphere();
  const auto refuse = [&](const std::string& options, const Words& words) {
    expect_refusal(2, Words(kRemesh) + ("out.ply --resolution 60 --tiles " + options), words);
  };
  refuse("--thin keep", {"--thin", "drop"});
  refuse("--signs flood-fill", {"--signs", "winding-number"});
  refuse("--isovalue 0.1", {"--isovalue"});
  refuse("--tile 5/4", {"--tile", "5/4"});
  refuse("--tile 1of4", {"--tile"});
  expect_refusal(1, Words(kRemesh) + "out.ply --resolution 60 --tiles=20", {"multiples of 8"});
  // A tetrahedron without one of its faces.
  write("open.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  expect_refusal(1, "remesh open.off out.ply --resolution 60 --tiles", {"open.off", "closed"});
}

}  // namespace cli_tiles_test
}  // namespace hermesh::cli
