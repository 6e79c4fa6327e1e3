#!/usr/bin/env bash
# Checks that each committed file has a licence and a copyright notice by REUSE.toml, and that LICENSES/ has the
# texts: packages/check_licences.sh; seconds. Needs Debian's package reuse; exits with 77 if it is not installed.
# The tool of Debian 12 is older than REUSE.toml, so a copy of the tree gets its predecessor, .reuse/dep5.
set -euo pipefail
cd "$(dirname "$0")/.."
if ! command -v reuse > /dev/null; then
  echo "check_licences: reuse is not installed (apt-get install reuse)" >&2
  exit 77
fi
diff -q LICENSE LICENSES/Apache-2.0.txt
copy=$(mktemp -d)
trap 'rm -rf "$copy"' EXIT
git ls-files -z | tar --null --files-from=- --create | tar --extract --directory "$copy"
cd "$copy"
mkdir .reuse
/usr/bin/python3 - > .reuse/dep5 <<'PY'
import tomllib
with open("REUSE.toml", "rb") as file:
    read = tomllib.load(file)
print("Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/")
print("Upstream-Name:", read["SPDX-PackageName"])
for each in read["annotations"]:
    paths = [each["path"]] if isinstance(each["path"], str) else each["path"]
    print("\nFiles:", " ".join(path.replace("**", "*") for path in paths))
    print("Copyright:", each["SPDX-FileCopyrightText"])
    print("License:", each["SPDX-License-Identifier"])
PY
git init --quiet .
reuse lint
