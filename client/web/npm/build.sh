#!/usr/bin/env bash
# Lays out the npm package @rilievo/decoder in BUILD_DIR/web/npm, with the WebAssembly module that is there.
#   client/web/npm/build.sh BUILD_DIR
set -euo pipefail
build=$(cd "$1" && pwd)
cd "$(dirname "$0")"
out=$build/web/npm
rm -rf "$out"
../node_modules/.bin/tsc -p tsconfig.json --outDir "$out"
cp "$build/web/rilievo.wasm" "$out/package/"
cp package.json README.md ../../../LICENSE "$out/"
