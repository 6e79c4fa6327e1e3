#!/usr/bin/env bash
# Tries the page of results in a browser: experiments/check_page.sh PROGRAM [FOLDER …]; some minutes, and no part of ctest, for
# it needs Chromium, node and npm (`apt-get install chromium nodejs npm`), and fetches puppeteer-core and axe-core.
# Makes a mesh of more than a million triangles and its row, writes the page of that and of each FOLDER with rows (a copy, so
# that nothing is written there), and lets check_page.mjs filter, sort, open rows, show meshes and look for violations of
# accessibility. Screenshots go to $SCREENSHOTS, else to a temporary folder, which is named at the end.
set -euo pipefail
if [ $# -lt 1 ]; then
  sed -n 2,6p "$0" | cut -c3-
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
program=$(realpath "$1")
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
pictures=${SCREENSHOTS:-$(mktemp -d)}
mkdir -p "$pictures"
for tool in node npm "${CHROMIUM:-chromium}"; do
  command -v "$tool" >/dev/null || { echo "check_page.sh: $tool is missing" >&2; exit 1; }
done
modules=${MODULES:-$work/modules}
if [ ! -d "$modules/node_modules/axe-core" ]; then
  mkdir -p "$modules"
  (cd "$modules" && npm init -y >/dev/null && npm install --no-audit --no-fund puppeteer-core@24 axe-core@4 >/dev/null)
fi

# A torus at a resolution that gives a million triangles, with distances and worst places.
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
bad=0
"$program" run "$work/million.toml" --out "$work/million" >/dev/null || { echo "the run of a million triangles failed" >&2; exit 1; }
"$program" report "$work/million" --format html
node "$here/check_page.mjs" "$modules" "$work/million/report.html" "$pictures" --triangles 1000000 || bad=1
for folder in "$@"; do
  copy=$work/pages/$(basename "$(realpath "$folder")")
  mkdir -p "$work/pages"
  cp -r "$(realpath "$folder")" "$copy"
  "$program" report "$copy" --format html
  node "$here/check_page.mjs" "$modules" "$copy/report.html" "$pictures" || bad=1
done
echo "screenshots: $pictures"
exit $bad
