#!/usr/bin/env bash
# Checks that another program can be built against the installed libraries: packages/cpp/check_package.sh
# BUILD [--shared]; a quarter of a minute. With --shared it checks a build of shared libraries next to BUILD,
# whose objects ccache has from BUILD. Installs the libraries and headers of a build into BUILD/package_check,
# compiles packages/cpp/example against them, which must take less than 20 s, and runs it; counts headers and
# symbols, and prints sizes. Shared libraries must export only public names. Inside another project no test of
# ours may be built, and no warning be an error. Exits with 1 and a message on failure.
set -euo pipefail
cd "$(dirname "$0")"
build=$1
if [ "${2:-}" = --shared ]; then
  # A directory of the same depth, so that ccache finds the objects.
  build=${build%/}_shared
  { (cd ../.. && cmake --preset release -B "$build" -DBUILD_SHARED_LIBS=ON -DHERMESH_BUILD_PROGRAM=OFF \
      -DHERMESH_BUILD_TESTS=OFF -DHERMESH_BUILD_PYTHON=OFF) && cmake --build "$build"; } > "$1/shared.log" 2>&1 ||
    { tail -50 "$1/shared.log"; exit 1; }
fi
where=$build/package_check
rm -rf "$where"
mkdir -p "$where"
for component in runtime validation development; do
  cmake --install "$build" --prefix "$where/prefix" --component $component > "$where/install.log"
done

# Only public headers may be installed, and they may include no others of ours.
headers=$(find "$where/prefix/include" -type f | wc -l)
inner=$(grep -rlE '#include ("algorithms/|"validation/|<Eigen|<tbb|<CGAL)' "$where/prefix/include" || true)
if [ -n "$inner" ]; then echo "public headers include what is not installed: $inner"; exit 1; fi
heavy=$(grep -rlE '#include [<"]openvdb' "$where/prefix/include" | grep -v '/hermesh/openvdb.h$' || true)
if [ -n "$heavy" ]; then echo "public headers include OpenVDB: $heavy"; exit 1; fi
echo "headers: $headers, $(cat "$where"/prefix/include/hermesh/*.h | wc -l) lines"
find "$where/prefix" \( -name '*.a' -o -name '*.so*' \) -type f -printf 'library: %f, %s bytes\n' | sort

find "$where/prefix" -name '*.so' | sort | xargs -r ./check_symbols.sh

# The headers compile without warnings.
for compiler in g++ clang++; do
  if command -v $compiler > /dev/null; then
    $compiler -std=c++20 -Wall -Wextra -Wpedantic -Wshadow -Werror -fsyntax-only -I "$where/prefix/include" example/main.cpp
  fi
done

# Processor time, so that other processes on the machine do not count.
TIMEFORMAT="%R %U %S"
{ time { cmake -S example -B "$where/example" -G Ninja -DCMAKE_PREFIX_PATH="$where/prefix" && cmake --build "$where/example"; } \
    > "$where/example.log" 2>&1; } 2> "$where/took.txt" || { cat "$where/example.log"; exit 1; }
read -r elapsed user system < "$where/took.txt"
echo "example: configured and built in $elapsed s, $user s + $system s of the processor"
awk "BEGIN { exit !($user + $system < 20) }" || { echo "that is more than 20 s"; exit 1; }
"$where/example/example" > "$where/output.txt" || { cat "$where/output.txt"; exit 1; }
tail -1 "$where/output.txt"

# Inside another project, which is configured and not built: that would take as long as the libraries do.
cmake -S example -B "$where/parent" -G Ninja -DHERMESH_SOURCE="$(cd ../.. && pwd)" > "$where/parent.log" 2>&1 ||
  { cat "$where/parent.log"; exit 1; }
if grep -qE -e '-Werror' "$where/parent/build.ninja"; then echo "inside another project warnings are errors"; exit 1; fi
if ninja -C "$where/parent" -t targets all | grep -qE '_test(:|$)|^hermesh: phony'; then
  echo "inside another project more is built than the libraries"
  exit 1
fi
echo "inside another project: the libraries alone"
