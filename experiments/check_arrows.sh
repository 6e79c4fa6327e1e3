#!/usr/bin/env bash
# Checks the directions of includes that ARCHITECTURE.md specifies: experiments/check_arrows.sh; seconds,
# builds nothing. Tests and their helpers may include anything. Exits with 1 and lists each include that
# violates them.
set -euo pipefail
cd "$(dirname "$0")/.."

find algorithms reference validation packages/cpp experiments -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \) -print |
  grep -v -e '_test\.cpp$' -e '/test_' -e '_for_tests' -e '^experiments/promises/' -e '^experiments/bench/' | sort | xargs awk '
    BEGIN {
      may["core"] = ""
      may["lattice"] = may["search"] = "core"
      may["io"] = "core lattice"
      may["hermite"] = "core lattice search io"
      may["thesis/voxels"] = may["hermite"] " hermite"
      may["voxelization"] = may["extraction"] = may["thesis/voxels"] " thesis/voxels"
      may["fracture"] = may["voxelization"] " voxelization extraction"
      may["labels"] = may["fracture"] " fracture"
      may["remesh"] = may["voxelization"] " voxelization extraction"
      may["thesis"] = may["fracture"] " fracture"
      may["variants"] = may["thesis"] " thesis"
      may["reference"] = may["fracture"] " fracture"
      may["validation"] = "core io"
      may["packages"] = may["thesis"] " thesis labels remesh variants validation hermesh"
      # Within experiments; all of it may include algorithms, validation and reference.
      may["experiments/stages"] = may["experiments/pictures"] = ""
      may["experiments/cases"] = "experiments/stages"
      may["experiments/harness"] = "experiments/stages experiments/cases experiments/pictures"
      may["experiments/fracture"] = may["experiments/ablations"] = may["experiments/accuracy"] = may["experiments/harness"] " experiments/harness"
      may["experiments/measurements"] = may["experiments/accuracy"] " experiments/accuracy experiments/ablations experiments/fracture"
      may["experiments/cells"] = may["experiments/measurements"] " experiments/measurements"
      may["experiments/cli"] = "experiments/stages experiments/fracture"
      may["experiments/fuzzing"] = "experiments/cli experiments/harness"
    }
    function room(path,    part) {
      split(path, part, "/")
      if (part[1] == "experiments") return part[1] "/" (part[3] == "" ? "stages" : part[2])
      if (part[1] != "algorithms") return part[1]
      if (part[2] == "thesis" && part[3] == "voxels") return "thesis/voxels"
      return part[2] ~ /^(variants|voxelizers)\./ ? "variants" : part[2]
    }
    /^#include "/ {
      split($0, quoted, "\"")
      from = room(FILENAME)
      to = room(quoted[2])
      if (from ~ /^experiments/ && to !~ /^experiments/) next
      if (from != to && (" " may[from] " ") !~ (" " to " ")) { print FILENAME " includes " quoted[2]; bad = 1 }
    }
    END { exit bad }'
echo "arrows: all includes point one way"
