#!/usr/bin/env bash
# A newcomer's first hour: a clean clone, the commands between the `first hour:` marks of its README
# as they stand there, and a scan dropped on the page they serve, in Chromium, until its surface is
# seen. The picture is left in BUILD/first_hour.png.
#   first_hour.sh SOURCE BUILD
# What is not done again is the compiling: the clone's cmake is one that puts the finished programs
# of BUILD in place when it is asked to build, and refuses everything else. The page is built anew, with
# the modules that SOURCE has installed, if its lock file is the clone's.
# Ends with 77 (skipped, for ctest) and a sentence where a tool is not there.
set -euo pipefail
source=$(cd "$1" && pwd)
build=$(cd "$2" && pwd)

skip() {
  echo "skipped: $*"
  exit 77
}
for tool in node npm git protoc; do
  command -v "$tool" >/dev/null || skip "$tool is not installed"
done
node -e 'const [a, b] = process.versions.node.split(".").map(Number);
  process.exit(a > 18 || (a === 18 && b >= 19) ? 0 : 1)' ||
  skip "node $(node --version) is too old: 18.19 or newer is needed"
export CHROMIUM=${CHROMIUM:-/usr/bin/chromium}
[ -x "$CHROMIUM" ] || skip "$CHROMIUM is not installed (Debian package chromium)"
[ -e "$source/.git" ] || skip "$source is no clone"
[ -f "$build/web/rilievo.wasm" ] || skip "$build/web/rilievo.wasm was not built"

root=$(mktemp -d)
web=""
trap '[ -z "$web" ] || { kill "$web"; wait "$web" || true; }; rm -rf "$root"' EXIT
git clone -q "$source" "$root/rilievo"
modules=$source/client/web/node_modules
if cmp -s "$modules/.installed-lock" "$root/rilievo/client/web/package-lock.json"; then
  cp -a "$modules" "$root/rilievo/client/web/"
fi
mkdir "$root/tools"
cat >"$root/tools/cmake" <<SHIM
#!/bin/bash
set -eu
case "\$*" in
  "--preset release") mkdir -p build/release/bin build/release/web; touch build/release/build.ninja ;;
  "--build build/release "*)
    cp "$build"/bin/{rilievo,rilievod,rilievo-worker} build/release/bin/
    cp "$build/web/rilievo.wasm" build/release/web/ ;;
  *) echo "cmake: not among what this test expects: \$*" >&2; exit 1 ;;
esac
SHIM
chmod +x "$root/tools/cmake"
export PATH=$root/tools:$PATH
cd "$root/rilievo"

sed -n '/<!-- first hour: begin -->/,/<!-- first hour: end -->/s/^    //p' README.md >"$root/commands"
[ "$(wc -l <"$root/commands")" -ge 2 ] || { echo "the README has no commands" >&2; exit 1; }
grep -q '^\./dev web' "$root/commands" || { echo "none of them serves the page" >&2; exit 1; }
while read -r command; do
  echo "\$ $command"
  if [[ $command == "./dev web"* ]]; then
    # The last of them, in the foreground for people. A free port instead of the README's.
    bash -c "exec ${command%%#*} --listen 127.0.0.1:0" >"$root/page" 2>"$root/page.err" &
    web=$!
  else
    bash -euo pipefail -c "$command" </dev/null
  fi
done <"$root/commands"
until grep -qs ^http "$root/page"; do
  kill -0 "$web" 2>/dev/null || {
    web=""
    cat "$root/page" "$root/page.err" >&2
    npm ping --fetch-retries=0 >/dev/null 2>&1 || skip "npm's registry does not answer"
    exit 1
  }
  sleep 0.2
done
# Files that the README says are there.
for file in surface.dss surface.ply surface.png scan.ply; do
  [ -s "demo/$file" ] || { echo "there is no demo/$file" >&2; exit 1; }
done
# The newcomer's own scan.
build/release/bin/rilievo simulate star -o scan.ply
node tests/install/first_hour.mjs "$(grep -m1 ^http "$root/page")" scan.ply "$build/first_hour.png"
