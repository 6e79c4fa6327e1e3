#!/usr/bin/env bash
# Tests the page of results in a browser: experiments/lab/page/check_page.sh PROGRAM [DIRECTORY ...]
# It takes some minutes and is not part of the tests, since it needs Chromium, node and npm
# (`apt-get install chromium nodejs npm`) and downloads puppeteer-core and axe-core.
# It makes a mesh of more than a million triangles and its row, writes the page of that and of a copy of each
# DIRECTORY with rows, and check_page.mjs filters, sorts, opens rows, shows meshes and looks for violations of
# accessibility. Screenshots go to $SCREENSHOTS, else to a temporary directory, which is printed at the end.
set -euo pipefail
if [ $# -lt 1 ]; then
  sed -n 2,7p "$0" | cut -c3-
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
HERMESH=$(realpath "$1")
export HERMESH
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=$(realpath "${SCREENSHOTS:-$(mktemp -d)}")
mkdir -p "$pictures"
for tool in node npm "${CHROMIUM:-chromium}"; do
  command -v "$tool" >/dev/null || { echo "check_page.sh: $tool is missing" >&2; exit 1; }
done
modules=${MODULES:-$work/modules}
if [ ! -d "$modules/node_modules/axe-core" ]; then
  mkdir -p "$modules"
  (cd "$modules" && npm init -y && npm install --no-audit --no-fund puppeteer-core@24 axe-core@4) >/dev/null
fi
bad=0
check() {  # DIRECTORY, further arguments of check_page.mjs
  (cd "$here/../../.." && /usr/bin/python3 -m experiments.lab report "$1" --format html)
  node "$here/check_page.mjs" "$modules" "$1/report.html" "$pictures" "${@:2}" || bad=1
}

# A torus at a resolution that gives a million triangles, with distances and the farthest vertices.
cat > "$work/million.toml" <<'TOML'
question = "Does the page show a million triangles?"
voxelizers = ["hermesh"]
columns = ["triangles", "seconds", "to_rms", "to_max", "promises"]
[[variants]]
name = "marching-cubes"
[[variants]]
name = "adaptive-dual-contouring"
[quick]
repetitions = 2
seconds_per_variant = 1.0
samples = 50000
pixels = 0
self_intersections = false
[[quick.cases]]
name = "torus"
resolutions = [420]
TOML
if ! "$HERMESH" run "$work/million.toml" --out "$work/million" >/dev/null; then
  echo "check_page.sh: the run of a million triangles failed" >&2
  exit 1
fi
check "$work/million" --triangles 1000000
mkdir "$work/pages"
for directory in "$@"; do
  copy=$work/pages/$(basename "$(realpath "$directory")")
  cp -r "$(realpath "$directory")" "$copy"
  check "$copy"
done
echo "screenshots: $pictures"
exit $bad
