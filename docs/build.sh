#!/usr/bin/env bash
# Builds the documentation site, build/docs/html: docs/build.sh, also ./reproduce --docs. Installs missing
# packages. The pages have the help of the program and the docstrings of the Python module, which are built
# first if they are not up to date; the site itself takes less than a minute and needs no network.
#   docs/build.sh --built    takes both from build/release without building them
# $HERMESH and $HERMESH_PYTHON, if set, are a program and a folder with the module hermesh that are used instead,
# e.g. /usr/bin/hermesh and /usr/lib/python3/dist-packages of the Debian packages; then nothing is compiled.
set -euo pipefail
cd "$(dirname "$0")/.."
. experiments/install_packages.sh

out=build/docs
install_packages "${docs_packages[@]}"
if [ "${1:-}" != --built ] && [ -z "${HERMESH_PYTHON:-}" ]; then
  install_packages "${hermesh_packages[@]}"
  mkdir -p "$out"
  echo "Building the program and the Python module (the first time takes some minutes)"
  if ! { cmake --preset release && cmake --build --preset release --target hermesh hermesh_wheel; } \
      >"$out/build.log" 2>&1; then
    tail -n 60 "$out/build.log" >&2
    exit 1
  fi
fi

rm -rf "$out/python" "$out/html" "$out/doxygen"
mkdir -p "$out/doxygen"
if [ -z "${HERMESH_PYTHON:-}" ]; then
  /usr/bin/python3 -m zipfile -e build/release/packages/python/wheel/hermesh-*.whl "$out/python"
fi
doxygen docs/Doxyfile
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null || echo 0)
export SOURCE_DATE_EPOCH
# -W: a warning is an error. --keep-going: list all of them.
/usr/bin/python3 -m sphinx -q -W --keep-going -c docs -d "$out/doctrees" -b html . "$out/html"
cat >"$out/html/index.html" <<'HTML'
<!DOCTYPE html><meta charset="utf-8"><title>hermesh</title>
<meta http-equiv="refresh" content="0; url=docs/index.html"><a href="docs/index.html">hermesh</a>
HTML
echo "The site is $out/html/index.html"
