#!/usr/bin/env bash
# Makes the Debian packages and looks at them: what they hold, and that their dependencies were found.
#   debian_package.sh BUILD
set -euo pipefail
build=$1
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT

(cd "$build" && cpack -G DEB -B "$root") >"$root/log" 2>&1 || { cat "$root/log" >&2; exit 1; }
programs=$(ls "$root"/rilievo_*.deb)
development=$(ls "$root"/librilievo-dev_*.deb)
depends=$(dpkg-deb -f "$programs" Depends)
echo "$(basename "$programs"): $(stat -c %s "$programs") bytes; $depends"
for library in libc6 'libgrpc++' libsqlite3 libpq5 libcurl4 libpng16; do
  grep -q "$library" <<<"$depends" || { echo "no dependency on $library" >&2; exit 1; }
done
dpkg-deb -x "$programs" "$root/programs"
for file in bin/rilievo bin/rilievod bin/rilievo-worker share/man/man1/rilievo.1 \
  share/man/man8/rilievod.8 share/bash-completion/completions/rilievo \
  lib/systemd/system/rilievod.service lib/systemd/system/rilievo-worker@.service; do
  [ -s "$root/programs/usr/$file" ] || { echo "not in the package: $file" >&2; exit 1; }
done
# The viewer is in it where it has been built.
if [ -f "$build/web/gateway.mjs" ]; then
  for file in gateway.mjs page/index.html; do
    [ -s "$root/programs/usr/share/rilievo/web/$file" ] || { echo "no $file in the package" >&2; exit 1; }
  done
  dpkg-deb -f "$programs" Suggests | grep -q nodejs
fi
"$root/programs/usr/bin/rilievo" simulate sphere -o "$root/a.ply" --points 500
"$root/programs/usr/bin/rilievo" reconstruct "$root/a.ply" -o "$root/a.dss" --quiet >/dev/null
listed=$(dpkg-deb -c "$development")
grep -q 'lib/cmake/rilievo/rilievo-config.cmake' <<<"$listed"
