#!/usr/bin/env bash
# Checks the exported symbols of shared libraries: packages/cpp/check_symbols.sh LIBRARY...; an instant.
# Counts the names of each, and exits with 1 if one is not public: of another namespace, or internal to the
# public functions.
set -euo pipefail
for library in "$@"; do
  names=$(nm -D --defined-only -C "$library" | sed -E 's/^[0-9a-f]* *[A-Za-z] //')
  echo "symbols: $(wc -l <<< "$names") of $(basename "$library")"
  others=$(grep -vE '^((typeinfo|vtable|typeinfo name) for )?hermesh::v1::|^HERMESH_1$' <<< "$names" || true)
  others+=$(grep -E '^[^(]*(::Inside|Arrays::|Data::|Grid::|std::|openvdb::)' <<< "$names" || true)
  if [ -n "$others" ]; then echo "shown, but not public:"; head -20 <<< "$others"; exit 1; fi
done
