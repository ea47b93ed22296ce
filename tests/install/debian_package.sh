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
in_package() { # NAME FILE...
  local listed name=$1
  listed=$(dpkg-deb -c "$root/${name}"_*.deb)
  shift
  for file in "$@"; do
    grep -q "[.]/usr/$file\( ->.*\)\?$" <<<"$listed" || { echo "not in $name: $file" >&2; exit 1; }
  done
}
# The viewer and STEP where they have been built, the decoder for other languages, Python.
[ ! -f "$build/web/gateway.mjs" ] ||
  in_package rilievo-viewer share/rilievo/web/gateway.mjs share/rilievo/web/page/index.html
dpkg-deb -f "$root"/rilievo-viewer_*_all.deb Depends | grep -q nodejs
[ ! -f "$build/lib/rilievo/librilievo_step.so" ] ||
  in_package rilievo-step lib/rilievo/librilievo_step.so
in_package librilievo-decoder1 lib/librilievo_decoder.so.1
in_package librilievo-decoder-dev lib/librilievo_decoder.so \
  include/rilievo/rilievo_decoder.h
[ ! -d "$build/python" ] ||
  in_package python3-rilievo lib/python3/dist-packages/rilievo/{__init__,v1/jobs_pb2}.py
"$root/programs/usr/bin/rilievo" simulate sphere -o "$root/a.ply" --points 500
"$root/programs/usr/bin/rilievo" reconstruct "$root/a.ply" -o "$root/a.dss" --quiet >/dev/null
listed=$(dpkg-deb -c "$development")
grep -q 'lib/cmake/rilievo/rilievo-config.cmake' <<<"$listed"
