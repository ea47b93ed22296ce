#!/usr/bin/env bash
# The viewer's tests, a part of them or all:
#   client/web/tests/run.sh BUILD_DIR [PART [NAME_PATTERN]]
# build: the page, the gateway, the tests and their types, which the other parts need; gateway; decoder:
# against the compiled one; page: in Chromium; formats: scans of scanners on the page; exports: files
# that the command line writes, read by others; loader: the npm package, with three.js on a page of its
# own; first_layer: the page again, where time is measured.
# Ends with 77 (skipped, for ctest) and a sentence where a tool is not there.
set -euo pipefail
build=$(cd "$1" && pwd)
part=${2:-all}
web=$(cd "$(dirname "$0")/.." && pwd)
root=$(cd "$web/../.." && pwd)

skip() {
  echo "skipped: $*"
  exit 77
}
command -v node >/dev/null || skip "node is not installed (Debian package nodejs)"
command -v npm >/dev/null || skip "npm is not installed (Debian package npm)"
node -e 'const [a, b] = process.versions.node.split(".").map(Number);
  process.exit(a > 18 || (a === 18 && b >= 19) ? 0 : 1)' ||
  skip "node $(node --version) is too old: 18.19 or newer is needed"
export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
[ -x "$CHROMIUM" ] || skip "$CHROMIUM is not installed (Debian package chromium)"
command -v protoc >/dev/null || skip "protoc is not installed (Debian package protobuf-compiler)"

cd "$web"
export RILIEVO_WEB_TESTS=$web/generated/tests
if [ "$part" = build ] || [ "$part" = all ]; then
  # Where this fails, tests of an older build are not run in its place.
  rm -rf "$RILIEVO_WEB_TESTS"
  ./build.sh "$build" || {
    npm ping --fetch-retries=0 >/dev/null 2>&1 || skip "npm's registry does not answer"
    exit 1
  }
  npm/build.sh "$build"
  npx tsc --noEmit --incremental --tsBuildInfoFile generated/types.tsbuildinfo
  npx vite build --logLevel warn --config vite.tests.config.ts
fi
[ "$part" = build ] && exit
[ -d "$RILIEVO_WEB_TESTS" ] || skip "the page was not built (the part build says why)"
export BIN=$build/bin WEB=$build/web WASM=$build/web/rilievo.wasm
export PYTHON_PACKAGE=$build/python DECODER_LIBRARY=$build/lib/librilievo_decoder.so
export GOLDEN=$root/tests/golden CORPUS=$root/tests/fuzz/corpus REFERENCE=$web/tests/reference
status=0
[ "$part" = all ] && part="gateway decoder page formats exports loader first_layer"
for name in $part; do
  node --test ${3:+--test-name-pattern="$3"} "generated/tests/$name.test.js" || status=1
done
exit $status
