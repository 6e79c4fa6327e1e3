#!/usr/bin/env bash
# Builds the Debian packages and the wheel twice, from nothing, and compares their bytes:
# packages/check_reproducible.sh [BUILD], build/reproducible by default; takes two builds. Exits with 1 if a file
# differs. Both builds are in the same folder, because programs contain the path of the experiments, and at
# different times and with different file times; the date within the packages is that of the commit. The second
# build compiles everything again, whatever ccache holds.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/reproducible}
first=$(mktemp -d)
trap 'rm -rf "$first"' EXIT

rm -rf "$build"
packages/make_packages.sh "$build"
cp "$build"/debian/* "$first"
rm -rf "$build"
CCACHE_RECACHE=1 packages/make_packages.sh "$build"

bad=0
for file in "$first"/*; do
  if cmp "$file" "$build/debian/$(basename "$file")"; then
    sha256sum "$build/debian/$(basename "$file")"
  else
    bad=1
  fi
done
[ "$(ls "$first")" = "$(ls "$build/debian")" ] || { echo "reproducible: the builds made different files" >&2; bad=1; }
[ "$bad" = 0 ] && echo "reproducible: both builds made the same bytes"
exit "$bad"
