#!/usr/bin/env bash
# Whether the packages work on a machine that has nothing but them:
#   packages/check_clean_debian.sh [--base FOLDER] [DEBS]     build/packages/debian unless said, where make_packages.sh leaves them
# Makes a temporary clean Debian 12 with debootstrap, as root, within some minutes, and there, as a user would,
#   - installs the wheel that lies beside the packages into a fresh virtual environment and runs the examples of Python;
#   - installs program, libraries and Python module, runs the program, reads its manual, and runs the examples once more;
#   - installs the development package, and builds the example of C++ within 20 s of the processor;
#   - counts sizes, headers and symbols, and takes all packages off again, of which no file may be left.
# Packages come from wherever this machine's apt finds Debian 12. With $HERMESH_DATA the examples run with its models, too.
# --base takes a tree that debootstrap made (and leaves it alone) instead of making one. Exits with 1 and says what is wrong.
set -euo pipefail
cd "$(dirname "$0")/.."
fail() { echo "check_clean_debian: $*" >&2; exit 1; }

base=
if [ "${1:-}" = --base ]; then base=$(realpath "$2"); shift 2; fi
[ $# -le 1 ] && [ "${1:-}" != --help ] || { sed -n '2,11p' "$0" | sed 's/^# \{0,1\}//'; exit 2; }
debs=$(realpath "${1:-build/packages/debian}")
[ "$(id -u)" -eq 0 ] || fail "only root can make a system of its own; run it with sudo"
[ -n "$base" ] || command -v debootstrap > /dev/null || fail "debootstrap is missing (apt-get install debootstrap)"
for name in hermesh_ libhermesh1_ libhermesh-validation1_ libhermesh-dev_ python3-hermesh_; do
  compgen -G "$debs/$name*.deb" > /dev/null || fail "$debs has no $name*.deb; packages/make_packages.sh makes it"
done
compgen -G "$debs/hermesh-*.whl" > /dev/null || fail "$debs has no wheel; packages/make_packages.sh makes it"

# What is mounted is seen by nobody else, and gone when this ends.
if [ -z "${HERMESH_OWN_MOUNTS:-}" ]; then
  [ -n "$base" ] && set -- --base "$base" "$debs" || set -- "$debs"
  HERMESH_OWN_MOUNTS=1 exec unshare --mount --propagation private "$(realpath "$0")" "$@"
fi
root=$(mktemp -d "${TMPDIR:-/tmp}/hermesh_debian.XXXXXX")
chmod 755 "$root"  # its users look for their commands in it
clean_up() {
  umount "$root/proc" 2> /dev/null || true
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
trap 'exit 1' INT TERM

release=bookworm
# The archives that apt reads here for that release, and how it is told to reach them.
archives=$(apt-get indextargets --format '$(REPO_URI) $(CODENAME)' 'Identifier: Packages' 'Component: main' 2> /dev/null |
  awk -v r=$release '($2 == r || $2 == r "-updates" || $2 == r "-security") && $1 ~ /\/debian(-security)?\/?$/' | sort -u)
mirror=$(awk -v r=$release '$2 == r { print $1; exit }' <<< "$archives")
[ -n "$mirror" ] || fail "apt on this machine knows no archive of Debian 12"
if [ -n "$base" ]; then
  cp -a "$base/." "$root"
else
  echo "making a clean Debian 12"
  log=$(mktemp)
  for protocol in http https; do
    proxy=$(apt-config shell proxy "Acquire::$protocol::Proxy" | sed "s/^proxy='\(.*\)'$/\1/")
    [ -z "$proxy" ] || export "${protocol}_proxy=$proxy"
  done
  debootstrap --variant=minbase $release "$root" "$mirror" > "$log" 2>&1 || { tail -20 "$log"; rm "$log"; fail "debootstrap failed"; }
  rm "$log"
fi
mkdir -p "$root/etc/apt/apt.conf.d"
sed -E 's/^([^ ]+) ([^ ]+)$/deb \1 \2 main/' <<< "$archives" > "$root/etc/apt/sources.list"
rm -rf "$root"/etc/apt/sources.list.d/*
apt-config dump | grep -E '^Acquire::(https?::|Check-)' > "$root/etc/apt/apt.conf.d/90as-outside" || true
for file in /etc/resolv.conf /etc/hosts /etc/ssl/certs/ca-certificates.crt; do
  if [ -e "$file" ]; then mkdir -p "$root$(dirname $file)"; cp -L "$file" "$root$file"; fi
done
mount -t proc proc "$root/proc"

as_root() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
as_user() {  # a command line, in the user's folder
  chroot --userspec=1000:1000 "$root" env -i PATH=/usr/bin:/bin LC_ALL=C.UTF-8 HOME=/home/user TERM=dumb ${in_chroot_data:-} \
    bash -euo pipefail -c "cd; $1"
}
install() {
  as_root apt-get install -y --no-install-recommends "$@" > "$root/apt.log" 2>&1 || { tail -20 "$root/apt.log"; fail "apt-get install $* failed"; }
}
packages() { for name in "$@"; do (cd "$root" && printf '/%s\n' debs/"$name"_*.deb); done; }
as_root apt-get update > "$root/apt.log" 2>&1 || { tail -20 "$root/apt.log"; fail "apt-get update failed"; }
as_root useradd --uid 1000 --create-home --shell /bin/bash user
mkdir "$root/debs" "$root/home/user/source" "$root/home/user/models"
cp "$debs"/*.deb "$debs"/*.whl "$root/debs"
cp -r packages/python packages/cpp/example packages/cpp/check_symbols.sh "$root/home/user/source"
in_chroot_data=
if [ -n "${HERMESH_DATA:-}" ]; then
  for model in $(sed -n 's/.*shapes\.model("\([^"]*\)").*/\1/p' packages/python/examples/*.py); do
    [ ! -e "$HERMESH_DATA/$model" ] || cp -L "$HERMESH_DATA/$model" "$root/home/user/models"
  done
  in_chroot_data=HERMESH_DATA=/home/user/models
fi
chown -R 1000:1000 "$root/home/user"
chmod -R a+rX "$root/debs"

echo "== the wheel, in a fresh virtual environment"
# The README of the module says which packages these are.
install $(sed -n 's/^sudo apt-get install --no-install-recommends \(python3-venv .*\)$/\1/p' packages/python/README.md)
as_user 'python3 source/python/tests/run_examples.py /debs/hermesh-*.whl'

echo "== program, libraries and Python module"
install man-db $(packages hermesh libhermesh1 libhermesh-validation1 python3-hermesh)
as_user 'hermesh --version | head -1; hermesh doctor || echo "doctor: exit code $?"; man -P cat hermesh | sed -n "1,5p"'
as_user 'printf "OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n" > box.off
  hermesh remesh box.off out.ply --resolution 50
  hermesh validate out.ply'
as_user 'python3 source/python/tests/run_examples.py --installed'

echo "== development package"
install g++ cmake make
install $(packages libhermesh-dev)
# What else runs on the machine does not count.
as_user 'TIMEFORMAT="%R %U %S"
  { time { cmake -S source/example -B example && cmake --build example; } > log 2>&1; } 2> took || { cat log; exit 1; }
  read -r elapsed user system < took
  echo "example: configured and built in $elapsed s, $user s + $system s of the processor"
  awk "BEGIN { exit !($user + $system < 20) }" || { echo "that is more than 20 s"; exit 1; }
  example/example | tail -1'

echo "== what there is"
as_root dpkg-query -W -f 'installed: ${Package} ${Installed-Size} kB\n' '*hermesh*'
echo "headers: $(find "$root/usr/include/hermesh" -type f | wc -l), $(cat "$root"/usr/include/hermesh/*.h | wc -l) lines"
as_user 'source/check_symbols.sh $(ls /usr/lib/*/libhermesh*.so)'

as_root apt-get purge -y '^(lib|python3-)?hermesh.*' > "$root/apt.log" 2>&1 || { tail -20 "$root/apt.log"; fail "the packages cannot be taken off"; }
left=$(find "$root/usr" "$root/etc" "$root/var/lib/dpkg/info" -iname '*hermesh*' | sed "s#^$root##")
[ -z "$left" ] || { echo "$left"; fail "files are left when all packages are taken off"; }
echo "the packages work on a clean Debian 12"
