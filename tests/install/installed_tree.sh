#!/usr/bin/env bash
# Installs the build into a folder and uses it as a stranger would: the programs, an example with
# find_package, another with pkg-config.
#   installed_tree.sh SOURCE BUILD
set -euo pipefail
source=$1
build=$2
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT

cmake --install "$build" --prefix "$root/prefix" --component programs >/dev/null
cmake --install "$build" --prefix "$root/prefix" --component development >/dev/null
prefix=$root/prefix

"$prefix/bin/rilievo" --version | grep -q '^rilievo [0-9]'
"$prefix/bin/rilievod" --version | grep -q '^rilievod [0-9]'
for file in share/man/man1/rilievo.1 share/man/man8/rilievod.8 \
  share/bash-completion/completions/rilievo share/doc/rilievo/copyright \
  lib/systemd/system/rilievod.service lib/systemd/system/rilievo-worker@.service; do
  [ -s "$prefix/$file" ] || { echo "not installed: $file" >&2; exit 1; }
done
grep -q 'fB..-..-listen\|-listen' "$prefix/share/man/man8/rilievod.8"
if grep -rl "$source" "$prefix/lib/cmake" "$prefix/lib/pkgconfig"; then
  echo "these name the source folder" >&2
  exit 1
fi

if grep -rnE '#include "(core|client|rilievo|google|grpc)/' "$prefix/include/rilievo"; then
  echo "these headers are not named under <rilievo/...>" >&2
  exit 1
fi

cmake -S "$source/examples/reconstruct" -B "$root/example" -DCMAKE_PREFIX_PATH="$prefix" \
  -DCMAKE_BUILD_TYPE=Release >"$root/log" 2>&1 && cmake --build "$root/example" >>"$root/log" 2>&1 ||
  { cat "$root/log" >&2; exit 1; }
said=$("$root/example/reconstruct")
echo "example: $said"
[[ $said == "genus 1, "* ]]

# The decoder alone, by pkg-config, and the C interface's older namesake is not taken.
flags=$(PKG_CONFIG_PATH=$prefix/lib/pkgconfig pkg-config --cflags --libs rilievo-decoder)
sed 's,#include "\(core/.*\)",#include <rilievo/\1>,' "$source/tests/decoder/decode_only.cc" >"$root/decode_only.cc"
# shellcheck disable=SC2086
g++ -std=c++20 -o "$root/decode_only" "$root/decode_only.cc" $flags
vertices=$("$root/decode_only" "$source/tests/golden/sheet_and_octahedron_v2.dss" 3 | grep -c '^v ')
echo "decoder by pkg-config: $vertices vertices"
[ "$vertices" -eq 1562 ]
