#!/usr/bin/python3
"""Packs the programs with all their shared libraries except glibc, for distributions other than Debian with glibc 2.36 or newer.

usage: tools/make_tarball.py BUILD_FOLDER OUT_FOLDER      writes OUT_FOLDER/waymark-VERSION-linux-ARCH.tar.xz
Libraries remain shared, in lib/ beside the program, so that each can be replaced as its licence requires (LGPL: cairo and its dependencies);
their notices are in share/doc/notices. The same build gives the same bytes.
"""
import io
import lzma
import os
import pathlib
import platform
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from make_sbom import libraries, owner  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent
GLIBC = re.compile(r"^(ld-linux.*|libc|libm|libdl|libpthread|librt|libresolv|libutil)\.so")


def stage(build, top):
    """The folder to pack: bin, lib, libexec, share."""
    subprocess.run(["cmake", "--install", build, "--prefix", top, "--component", "program", "--strip"], check=True, stdout=subprocess.DEVNULL)
    for extra in ("lib/udev", "lib/systemd", "share/bash-completion", "share/zsh", "share/fish"):
        place = pathlib.Path(top) / extra
        if place.exists():
            (pathlib.Path(top) / "share/doc/waymark/extras").mkdir(parents=True, exist_ok=True)
            shutil.move(place, pathlib.Path(top) / "share/doc/waymark/extras" / place.name)
    programs = {top / "bin/waymark": "$ORIGIN/../lib", top / "libexec/waymark/waymark-watchdog": "$ORIGIN/../../lib"}
    library_folder, notices = top / "lib", top / "share/doc/notices"
    library_folder.mkdir(exist_ok=True)
    notices.mkdir(parents=True)
    for program, path in programs.items():
        names = dict(re.findall(r"(\S+) => (/\S+)", subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout))
        for name, place in names.items():
            if GLIBC.match(name):
                continue
            shutil.copy(place, library_folder / name)
            package = owner(pathlib.Path(place).resolve())
            shutil.copy(f"/usr/share/doc/{package}/copyright", notices / package)
        subprocess.run(["patchelf", "--set-rpath", path, program], check=True)
    for library in library_folder.iterdir():
        subprocess.run(["patchelf", "--set-rpath", "$ORIGIN", library], check=True)


def pack(top, out, epoch):
    """A tar archive whose bytes depend only on its files."""
    raw = io.BytesIO()
    with tarfile.open(fileobj=raw, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for path in sorted(top.parent.rglob("*")):
            entry = archive.gettarinfo(path, path.relative_to(top.parent))
            entry.uid = entry.gid = 0
            entry.uname = entry.gname = "root"
            entry.mtime = epoch
            archive.addfile(entry, path.open("rb") if path.is_file() and not path.is_symlink() else None)
    out.write_bytes(lzma.compress(raw.getvalue(), preset=6))


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    version = re.search(r"project\(Waymark VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")).group(1)
    name = f"waymark-{version}-linux-{platform.machine()}"
    with tempfile.TemporaryDirectory() as scratch:
        top = pathlib.Path(scratch) / name
        stage(sys.argv[1], top)
        out = pathlib.Path(sys.argv[2]) / f"{name}.tar.xz"
        out.parent.mkdir(parents=True, exist_ok=True)
        pack(top, out, int(os.environ.get("SOURCE_DATE_EPOCH", "0")))
        print(out)


if __name__ == "__main__":
    main()
