#!/usr/bin/python3
"""Prints the bill of materials of programs as SPDX 2.3 JSON: Debian packages linked or compiled in, and npm packages of the page.

usage: tools/make_sbom.py PROGRAM...
Shared libraries are those listed by `ldd`, each with its Debian package; header-only libraries are in HEADERS below.
"""
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEADERS = ["libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev", "libexpected-dev", "libboost-dev"]


def printed(*words):
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout


def libraries(program):
    """Paths of the shared libraries that are loaded when the program starts."""
    return [pathlib.Path(path).resolve() for path in re.findall(r"=> (/\S+)", printed("ldd", program))]


def owner(path):
    """The Debian package of a file; /lib and /usr/lib are one folder on a merged system."""
    for name in (str(path), str(path).removeprefix("/usr")):
        found = subprocess.run(["dpkg-query", "-S", name], capture_output=True, text=True)
        if found.returncode == 0:
            return found.stdout.split(":")[0]
    sys.exit(f"make_sbom.py: no Debian package owns {path}")


def debian(name, linked):
    version, source, homepage = printed("dpkg-query", "-W", "-f", "${Version}\t${source:Package}\t${Homepage}\n", name).split("\n")[0].split("\t")
    return {"name": name, "SPDXID": "SPDXRef-deb-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "versionInfo": version, "sourceInfo": f"Debian source package {source}",
            "downloadLocation": homepage or "NOASSERTION", "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "copyrightText": "NOASSERTION",
            "filesAnalyzed": False, "comment": f"{linked}; licence in /usr/share/doc/{name}/copyright",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": f"pkg:deb/debian/{name}@{version}"}]}


def npm():
    """The packages in the page: those of viewer/package-lock.json that are not development tools."""
    lock = json.loads((ROOT / "viewer/package-lock.json").read_text(encoding="utf-8"))
    for place, entry in sorted(lock["packages"].items()):
        if not place or entry.get("dev"):
            continue
        name = place.split("node_modules/")[-1]
        yield {"name": name, "SPDXID": "SPDXRef-npm-" + re.sub(r"[^A-Za-z0-9.-]", "-", name), "versionInfo": entry["version"],
               "downloadLocation": f"https://www.npmjs.com/package/{name}", "licenseConcluded": "NOASSERTION", "licenseDeclared": entry.get("license", "NOASSERTION"),
               "copyrightText": "NOASSERTION", "filesAnalyzed": False, "comment": "in the page of waymark view",
               "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": f"pkg:npm/{name}@{entry['version']}"}]}


def main():
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    version = re.search(r"project\(Waymark VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    linked = sorted({owner(path) for program in sys.argv[1:] for path in libraries(program)})
    digest = hashlib.sha256(b"".join(pathlib.Path(program).read_bytes() for program in sys.argv[1:])).hexdigest()
    ours = {"name": "waymark", "SPDXID": "SPDXRef-waymark", "versionInfo": version, "downloadLocation": "NOASSERTION", "licenseConcluded": "BSD-3-Clause",
            "licenseDeclared": "BSD-3-Clause", "copyrightText": "2026, the Waymark authors", "filesAnalyzed": False}
    packages = [debian(name, "shared library") for name in linked] + [debian(name, "headers compiled in") for name in HEADERS] + list(npm())
    created = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    print(json.dumps({
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"waymark-{version}",
        "documentNamespace": f"https://example.org/waymark/spdx/{version}/{digest[:16]}",
        "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: waymark tools/make_sbom.py"]},
        "packages": [ours, *packages],
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-waymark"}] +
                         [{"spdxElementId": "SPDXRef-waymark", "relationshipType": "DEPENDS_ON", "relatedSpdxElement": one["SPDXID"]} for one in packages],
    }, indent=1))


if __name__ == "__main__":
    main()
