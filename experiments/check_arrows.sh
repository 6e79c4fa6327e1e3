#!/usr/bin/env bash
# Whether includes point the way that ARCHITECTURE.md says: experiments/check_arrows.sh; seconds, builds nothing.
# Tests and what is there for them may include anything. Exits with 1 and names each include that points another way.
set -euo pipefail
cd "$(dirname "$0")/.."

find algorithms reference validation packages/cpp -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \) -print |
  grep -v -e '_test\.cpp$' -e '/test_' -e '_for_tests' | sort | xargs awk '
    BEGIN {
      may["core"] = ""
      may["lattice"] = may["search"] = "core"
      may["io"] = "core lattice"
      may["hermite"] = "core lattice search io"
      may["voxelization"] = may["extraction"] = may["hermite"] " hermite"
      may["fracture"] = may["voxelization"] " voxelization extraction"
      may["remesh"] = may["voxelization"] " voxelization extraction"
      may["thesis"] = may["fracture"] " fracture"
      may["variants"] = may["thesis"] " thesis"
      may["reference"] = may["fracture"] " fracture"
      may["validation"] = "core io"
      may["packages"] = may["thesis"] " thesis remesh variants validation hermesh"
    }
    function room(path,    part) {
      split(path, part, "/")
      if (part[1] != "algorithms") return part[1]
      return part[2] ~ /^(variants|voxelizers)\./ ? "variants" : part[2]
    }
    /^#include "/ {
      split($0, quoted, "\"")
      from = room(FILENAME)
      to = room(quoted[2])
      # Who registers the grid types of OpenVDB has to know ours.
      if (FILENAME == "algorithms/core/level_set.cpp" && to == "hermite") next
      if (from != to && (" " may[from] " ") !~ (" " to " ")) { print FILENAME " includes " quoted[2]; bad = 1 }
    }
    END { exit bad }'
echo "arrows: all includes point one way"
