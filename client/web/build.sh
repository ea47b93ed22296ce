#!/usr/bin/env bash
# Builds the page and the gateway into BUILD_DIR/web, with the WebAssembly module that is there.
#   client/web/build.sh BUILD_DIR
set -euo pipefail
mkdir -p "$1/web"
build=$(cd "$1" && pwd)
cd "$(dirname "$0")"
export RILIEVO_WASM=$build/web/rilievo.wasm RILIEVO_WEB_OUT=$build/web
[ -f "$RILIEVO_WASM" ] || { echo "no $RILIEVO_WASM: build the target rilievo_wasm first" >&2; exit 1; }
# Only what the lock file names, and again only when it has changed.
if ! cmp -s package-lock.json node_modules/.installed-lock; then
  npm ci --ignore-scripts --no-audit --no-fund --prefer-offline --loglevel=error
  cp package-lock.json node_modules/.installed-lock
fi
node build/generate.mjs
npx vite build --logLevel warn
npx vite build --logLevel warn --config vite.gateway.config.ts
