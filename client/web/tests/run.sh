#!/usr/bin/env bash
# The viewer's tests: types, the gateway, the decoder against the compiled one, the page in Chromium.
#   client/web/tests/run.sh BUILD_DIR [NAME_PATTERN]
# Ends with 77 (skipped, for ctest) and a sentence where a tool is not there.
set -euo pipefail
build=$(cd "$1" && pwd)
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

"$web/build.sh" "$build" || {
  npm ping --fetch-retries=0 >/dev/null 2>&1 || skip "npm's registry does not answer"
  exit 1
}
cd "$web"
npx tsc --noEmit
export RILIEVO_WEB_TESTS=$web/generated/tests
npx vite build --logLevel warn --config vite.tests.config.ts
export BIN=$build/bin WEB=$build/web WASM=$build/web/rilievo.wasm
export PYTHON_PACKAGE=$build/python DECODER_LIBRARY=$build/lib/librilievo_decoder.so
export GOLDEN=$root/tests/golden CORPUS=$root/tests/fuzz/corpus REFERENCE=$web/tests/reference
status=0
for part in gateway decoder page formats; do # one after the other: two of them measure
  node --test ${2:+--test-name-pattern="$2"} "generated/tests/$part.test.js" || status=1
done
exit $status
