#!/usr/bin/env bash
# The packages in a clean Debian: lintian, install, demo, upgrade, remove, purge; what is left is only what the user made.
# Then a program compiled against libwaymark-dev, and the tarball in a Debian without any library of ours. Needs root (mmdebstrap, chroot).
# usage: tests/packages/test.sh FOLDER_WITH_PACKAGES
set -euo pipefail
root="$(cd "$(dirname "$0")/../.." && pwd)"
packages="$(realpath "${1:?usage: tests/packages/test.sh FOLDER_WITH_PACKAGES}")"
# shellcheck source=tools/packages.sh
source "$root/tools/packages.sh"
waymark_install lintian mmdebstrap xz-utils
program=$(ls "$packages"/waymark_*.deb)
library=$(ls "$packages"/libwaymark-dev_*.deb)
tarball=$(ls "$packages"/waymark-*.tar.xz)
fail() { echo "tests/packages: $*" >&2; exit 1; }

(cd "$packages" && sha256sum --quiet --check SHA256SUMS) || fail "checksums"
# Tags such as no-manual-page are not errors by default; the static library has no debug symbols on purpose.
lintian --allow-root --fail-on error --tag-display-limit 0 "$packages"/*.deb

scratch=$(mktemp -d)
finish() { for place in proc dev; do umount "$scratch"/*/"$place" 2>/dev/null || true; done; rm -rf --one-file-system "$scratch"; }
trap finish EXIT
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
mirrors=()  # those of the distribution alone, as a new system has them
for file in /etc/apt/sources.list /etc/apt/sources.list.d/{debian,ubuntu}.sources; do if [ -s "$file" ]; then mirrors+=("$file"); fi; done
mmdebstrap --quiet --variant=apt --mode=root "$suite" "$scratch/clean.tar" "${mirrors[@]}"
new_system() {  # new_system NAME: a clean Debian in $scratch/NAME
  mkdir -p "$scratch/$1"
  tar -C "$scratch/$1" -xf "$scratch/clean.tar"
  cp /etc/resolv.conf "$scratch/$1/etc/"
  mount -t proc proc "$scratch/$1/proc"
  mount --bind /dev "$scratch/$1/dev"
  inside "$1" useradd --create-home --uid 1000 person
  inside "$1" install -d -o person -g person /home/person/.cache
}
inside() { local name="$1"; shift; chroot "$scratch/$name" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"; }
person() { local name="$1"; shift; chroot --userspec=person:person "$scratch/$name" env -i PATH=/usr/bin:/bin HOME=/home/person LC_ALL=C.UTF-8 "$@"; }
# Caches, logs, the state of apt and dpkg, and the font caches of fontconfig do not belong to the packages.
files() { (cd "$scratch/$1" && find . -xdev -path ./proc -prune -o -path ./dev -prune -o -path ./var/cache -prune -o -path ./var/log -prune -o -path ./tmp -prune \
  -o -path ./var/lib/apt -prune -o -path ./var/lib/dpkg -prune -o -path ./etc/ld.so.cache -prune \
  -o -path ./usr/local/share/fonts -prune -o -path ./home/person/.cache/fontconfig -prune -o -print | LC_ALL=C sort); }

new_system user
inside user apt-get update -qq
cp "$program" "$library" "$scratch/user/tmp/"
inside user apt-get install -qq --no-install-recommends -y --download-only "/tmp/$(basename "$program")" >/dev/null
echo "dependencies of waymark to download: $(du -ch "$scratch"/user/var/cache/apt/archives/*.deb | tail -1 | cut -f1)"
files user >"$scratch/before"
began=$SECONDS
inside user apt-get install -qq --no-install-recommends -y "/tmp/$(basename "$program")" >"$scratch/install.log" 2>&1 || { cat "$scratch/install.log"; fail "install"; }
person user waymark demo -o /tmp/demo >"$scratch/demo.log" 2>&1 || { cat "$scratch/demo.log"; fail "demo"; }
echo "apt install and waymark demo: $((SECONDS - began)) s"
grep -qE '^map +tags, rmse +0\.0[0-9]+ m' "$scratch/demo.log" || { cat "$scratch/demo.log"; fail "the demo's figures are missing"; }
person user waymark --version
for file in usr/share/man/man1/waymark-map.1.gz usr/share/bash-completion/completions/waymark usr/share/zsh/vendor-completions/_waymark \
  usr/share/fish/vendor_completions.d/waymark.fish lib/udev/rules.d/60-waymark.rules lib/systemd/system/waymark@.service \
  usr/share/doc/waymark/copyright usr/share/doc/waymark/third-party-notices.gz usr/libexec/waymark/waymark-watchdog; do
  [ -s "$scratch/user/$file" ] || [ -n "$(inside user dpkg-query -L waymark | grep -x "/$file")" ] || fail "$file is not in the package"
done
inside user bash -c 'source /usr/share/bash-completion/completions/waymark; COMP_WORDS=(waymark tags sh); COMP_CWORD=2; _waymark; [ "${COMPREPLY[*]}" = sheet ] &&
  COMP_WORDS=(waymark map --anchor-p); COMP_CWORD=2; _waymark; [ "${COMPREPLY[*]}" = --anchor-pose ]' || fail "completion in bash"

"$root/tests/house/hardening_test.py" ON "$scratch"/user/usr/bin/waymark "$scratch"/user/usr/libexec/waymark/waymark-watchdog
echo "installed size: $(inside user dpkg-query -W -f '${Installed-Size}' waymark) KiB, of it the program $(($(stat -c %s "$scratch/user/usr/bin/waymark") / 1024)) KiB"

# An upgrade: the same package with a later version.
mkdir -p "$scratch/later"
dpkg-deb -R "$program" "$scratch/later/tree"
sed -i 's/^Version: .*/&+later/' "$scratch/later/tree/DEBIAN/control"
dpkg-deb --root-owner-group -b "$scratch/later/tree" "$scratch/user/tmp/later.deb" >/dev/null
inside user apt-get install -qq -y /tmp/later.deb >"$scratch/upgrade.log" 2>&1 || { cat "$scratch/upgrade.log"; fail "upgrade"; }
inside user dpkg-query -W -f '${Version}\n' waymark | grep -q '+later$' || fail "the upgrade left the old version"
person user waymark info /tmp/demo/lap.mcap >/dev/null || fail "a recording of before the upgrade is not read"

inside user dpkg-query -L waymark | while read -r file; do if [ -f "$scratch/user$file" ]; then echo "$file"; fi; done >"$scratch/ours"
inside user apt-get remove -qq -y waymark >"$scratch/remove.log" 2>&1 || { cat "$scratch/remove.log"; fail "remove"; }
while read -r file; do [ ! -e "$scratch/user$file" ] || fail "remove left $file"; done <"$scratch/ours"
inside user apt-get install -qq --no-install-recommends -y "/tmp/$(basename "$program")" >"$scratch/install.log" 2>&1 || { cat "$scratch/install.log"; fail "install again"; }
inside user apt-get purge -qq -y --autoremove waymark >"$scratch/purge.log" 2>&1 || { cat "$scratch/purge.log"; fail "purge"; }
files user >"$scratch/after"
diff "$scratch/before" "$scratch/after" || fail "purge left files (>) or took some (<)"
[ -s "$scratch/user/tmp/demo/lap.mcap" ] || fail "purge took what the user made"

inside user apt-get install -qq --no-install-recommends -y "/tmp/$(basename "$library")" g++ cmake ninja-build >"$scratch/library.log" 2>&1 || { cat "$scratch/library.log"; fail "install of the library"; }
mkdir "$scratch/user/tmp/tests" && cp -r "$root/tests/consumer" "$scratch/user/tmp/tests/" && cp -r "$root/examples" "$scratch/user/tmp/"
inside user cmake -G Ninja -S /tmp/tests/consumer -B /tmp/consumer-build -DCMAKE_BUILD_TYPE=Debug >"$scratch/consumer.log" 2>&1 &&
  inside user cmake --build /tmp/consumer-build --target consumer >>"$scratch/consumer.log" 2>&1 || { tail -40 "$scratch/consumer.log"; fail "a program compiled against libwaymark-dev"; }
inside user /tmp/consumer-build/consumer >/dev/null || fail "the consumer's program"

# Python: what it compiled in the folder of the package goes with it.
python=$(ls "$packages"/python3-waymark_*.deb)
cp "$python" "$scratch/user/tmp/"
inside user apt-get install -qq --no-install-recommends -y "/tmp/$(basename "$python")" "/tmp/$(basename "$program")" >"$scratch/python.log" 2>&1 || { cat "$scratch/python.log"; fail "install of the Python package"; }
person user python3 -c 'from waymark import recording
samples = sum(1 for _ in recording.Recording("/tmp/demo/lap.mcap"))
assert samples > 1000, samples
print("Python: samples of the lap:", samples)' || fail "the Python package"
inside user apt-get purge -qq -y python3-waymark >"$scratch/python.log" 2>&1 || { cat "$scratch/python.log"; fail "purge of the Python package"; }
[ ! -e "$scratch/user/usr/lib/python3/dist-packages/waymark" ] || fail "purge of the Python package left files"

new_system other
tar -C "$scratch/other/opt" -xf "$tarball"
person other sh -c '/opt/waymark-*/bin/waymark demo -o /tmp/demo' >"$scratch/tarball.log" 2>&1 || { cat "$scratch/tarball.log"; fail "the tarball's program"; }
echo "packages: passed"
