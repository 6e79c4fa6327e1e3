#!/usr/bin/env python3
"""Prints a software bill of materials (SPDX 2.3, JSON) of this checkout.

    packages/make_sbom.py [--binary build/release/hermesh] [--check]

Lists the packages of packages/dependencies.tsv with the version that is installed here, or that of
Debian 12 if none is, and with --binary also the Debian packages of the shared libraries that the binary
loads. --check only compares the list with experiments/install_packages.sh; exit code 3 if they differ.
"""

import argparse
import csv
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]


def dependencies():
    """Returns the rows of packages/dependencies.tsv."""
    with open(ROOT / "packages/dependencies.tsv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE))


def installed_packages():
    """Returns the packages that ./reproduce, ./test and docs/build.sh install."""
    text = (ROOT / "experiments/install_packages.sh").read_text()
    return " ".join(re.findall(r"(?m)^(?:hermesh|docs)_packages=\((.*?)\)", text, re.DOTALL)).split()


def problems():
    """Returns a message for each package that is in only one of the two lists."""
    listed, installed = {row["package"] for row in dependencies()}, set(installed_packages())
    return ([f"packages/dependencies.tsv lacks {name}" for name in sorted(installed - listed)]
            + [f"experiments/install_packages.sh does not install {name}"
               for name in sorted(listed - installed)])


def output_of(*command):
    """Returns the output of a command, "" if it is not installed."""
    try:
        return subprocess.run(command, capture_output=True, text=True).stdout
    except OSError:
        return ""


def libraries_of(binary):
    """Returns {Debian package: version} of the shared libraries that a binary loads."""
    files = re.findall(r"=> (/\S+)", output_of("ldd", binary))
    owners = [os.path.realpath(file) for file in files]
    # Debian's list has the paths of before /lib became a link to /usr/lib.
    found = output_of("dpkg", "-S", *owners, *(path.removeprefix("/usr") for path in owners))
    names = sorted({line.split(":")[0] for line in found.splitlines()})
    return {name: version_of(name) for name in names}


def version_of(package):
    # Of a name that several architectures have, the first one.
    return output_of("dpkg-query", "-W", "-f=${Version}\n", package).split("\n")[0]


def package(name, version, licence, comment):
    """Returns one package of SPDX."""
    entry = {"SPDXID": "SPDXRef-" + re.sub("[^A-Za-z0-9.]", "-", name), "name": name,
             "versionInfo": version or "NOASSERTION", "downloadLocation": "NOASSERTION",
             "filesAnalyzed": False, "licenseConcluded": "NOASSERTION", "licenseDeclared": licence,
             "copyrightText": "NOASSERTION"}
    if name != "hermesh":
        locator = f"pkg:deb/debian/{name}@{version}" if version else f"pkg:deb/debian/{name}"
        entry["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                                  "referenceLocator": locator}]
    return entry | ({"comment": comment} if comment else {})


def document(binary):
    """Returns the document of SPDX as an object."""
    version = re.search(r"VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    own = package("hermesh", version, "Apache-2.0", "The program and hermesh_validation are under "
                  "GPL-3 as a whole, because they link packages of CGAL.")
    others = [package(row["package"], version_of(row["package"]) or row["debian_12"], row["licence"],
                      f"{row['used_by']}: {row['reason']}") for row in dependencies()]
    named = {row["package"] for row in dependencies()}
    libraries = [package(name, found, "NOASSERTION", "shared library that the program loads")
                 for name, found in libraries_of(binary).items() if name not in named] if binary else []
    kinds = {row["package"]: "BUILD_TOOL_OF" if row["used_by"] == "build" else "TEST_DEPENDENCY_OF"
             if row["used_by"] == "tests" else "DEPENDENCY_OF" for row in dependencies()}
    relations = [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                  "relatedSpdxElement": own["SPDXID"]}]
    relations += [{"spdxElementId": each["SPDXID"], "relatedSpdxElement": own["SPDXID"],
                   "relationshipType": kinds.get(each["name"], "DYNAMIC_LINK")}
                  for each in [*others, *libraries]]
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH") or output_of(
        "git", "-C", str(ROOT), "log", "-1", "--format=%ct") or 0)
    created = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    packages = [own, *others, *libraries]
    digest = hashlib.sha256(json.dumps(packages).encode()).hexdigest()
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": f"hermesh-{version}", "documentNamespace": f"urn:sha256:{digest}",
            "creationInfo": {"created": created, "creators": ["Tool: hermesh-make_sbom"]},
            "packages": packages, "relationships": relations}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", help="also list the packages of the shared libraries that it loads")
    parser.add_argument("--check", action="store_true", help="only compare the two lists of packages")
    arguments = parser.parse_args()
    found = problems()
    print("".join(f"make_sbom: {problem}\n" for problem in found), end="", file=sys.stderr)
    if not arguments.check:
        print(json.dumps(document(arguments.binary), indent=1))
    return 3 if found else 0


if __name__ == "__main__":
    sys.exit(main())
