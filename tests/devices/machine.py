"""A Debian kernel with drivers of virtual devices, under QEMU without virtualisation. The root folder of this computer is shared read-only, so that
programs built here run there unchanged. Files that the machine writes to /mnt are in the folder "out" afterwards.

Needs Debian's qemu-system-x86, busybox-static, cpio, kmod and, to get the kernel, apt-get download."""
import pathlib
import re
import shutil
import subprocess

# vivid: a V4L2 camera, and an output whose images the camera captures; uinput: gamepads.
MODULES = ["virtio_pci", "9p", "9pnet_virtio", "vivid", "uinput", "evdev", "joydev"]
PROGRAMS = {"qemu-system-x86_64": "qemu-system-x86", "busybox": "busybox-static", "cpio": "cpio", "depmod": "kmod", "modprobe": "kmod", "v4l2-ctl": "v4l-utils"}

INIT = """#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc p /proc; mount -t sysfs s /sys; mount -t devtmpfs d /dev
for m in $(cat /modules/order); do case $m in vivid*) insmod /modules/$m n_devs=1 node_types=0x101;; *) insmod /modules/$m;; esac; done
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,ro,cache=loose host /host || echo "the root folder is not shared"
mount --bind /dev /host/dev; mount --bind /proc /host/proc; mount --bind /sys /host/sys
mount -t tmpfs t /host/run; mount -t tmpfs t /host/tmp
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /host/mnt || echo "the folder out is not shared"
echo "machine: started after $(cut -d' ' -f1 /proc/uptime) s"
chroot /host /bin/bash -c 'cd /tmp && export HOME=/tmp LANG=C.UTF-8 && {command}'
echo "machine: ended with $?"
poweroff -f
"""


def missing() -> list[str]:
    """Debian packages that must be installed first."""
    return sorted({package for program, package in PROGRAMS.items() if shutil.which(program, path="/usr/sbin:/sbin:/usr/bin:/bin") is None})


def run(command: str, **options) -> str:
    return subprocess.run(["bash", "-ec", command], check=True, capture_output=True, text=True, **options).stdout


def kernel(folder: pathlib.Path) -> tuple[pathlib.Path, str]:
    """Debian's newest kernel, unpacked in a folder, and its release."""
    folder.mkdir(parents=True, exist_ok=True)
    unpacked = folder / "kernel"
    if not unpacked.exists():
        package = re.search(r"Depends: (linux-image-\S+)", run("apt-cache depends linux-image-amd64"))[1]
        run(f"apt-get download {package} && dpkg -x {package}_*.deb kernel.part && rm {package}_*.deb && mv kernel.part kernel", cwd=folder)
    release = next((unpacked / "lib/modules").iterdir()).name
    run(f"/sbin/depmod -b {unpacked} {release}")
    return unpacked, release


def start_disk(folder: pathlib.Path, command: str) -> tuple[pathlib.Path, pathlib.Path]:
    """Kernel and first file system of a machine that runs a command of the shell and is switched off."""
    unpacked, release = kernel(folder)
    first = folder / "first"
    shutil.rmtree(first, ignore_errors=True)
    for name in ("bin", "modules", "host", "proc", "sys", "dev"):
        (first / name).mkdir(parents=True)
    shutil.copy(shutil.which("busybox"), first / "bin/busybox")
    order: list[str] = []
    for module in MODULES:
        for line in run(f"/sbin/modprobe -d {unpacked} -S {release} --show-depends {module}").splitlines():
            file = pathlib.Path(line.removeprefix("insmod ").split()[0])
            if line.startswith("insmod") and file.name not in order:
                order.append(file.name)
                shutil.copy(file, first / "modules")
    (first / "modules/order").write_text("\n".join(order) + "\n")
    (first / "init").write_text(INIT.replace("{command}", command))
    (first / "init").chmod(0o755)
    run("find . | cpio -o -H newc --quiet | gzip -1 > ../first.gz", cwd=first)
    return unpacked / f"boot/vmlinuz-{release}", folder / "first.gz"


def boot(folder: pathlib.Path, command: str, max_s: float) -> tuple[int | None, str]:
    """The exit code of a shell command in the machine, None if it did not end in time, and its output."""
    image, first = start_disk(folder, command)
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    words = ["qemu-system-x86_64", "-accel", "tcg,thread=multi", "-cpu", "max", "-m", "2048", "-smp", "2", "-nographic", "-no-reboot", "-net", "none",
             "-kernel", str(image), "-initrd", str(first), "-append", "console=ttyS0 loglevel=3 panic=-1 rdinit=/init",
             "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap",
             "-virtfs", f"local,path={out},mount_tag=out,security_model=none"]
    try:
        output = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=max_s, check=False).stdout
    except subprocess.TimeoutExpired as late:
        output = late.stdout or b""
    text = output.decode(errors="replace").replace("\r", "")
    code = re.search(r"machine: ended with (\d+)", text)
    return int(code[1]) if code else None, text
