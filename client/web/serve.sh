#!/usr/bin/env bash
# A server that keeps its jobs in BUILD_DIR/store, and the viewer before it, until Ctrl-C.
#   client/web/serve.sh BUILD_DIR [options of the gateway]
set -euo pipefail
build=$1
shift
log=$build/web/rilievod.log

"$build/bin/rilievod" --listen 127.0.0.1:0 --store "$build/store" >"$log" 2>&1 &
server=$!
trap 'kill -TERM $server 2>/dev/null; wait $server 2>/dev/null || true' EXIT
address=""
for _ in $(seq 100); do
  address=$(sed -n 's/.*listening on \([0-9.:]*\).*/\1/p' "$log" | head -1)
  [ -n "$address" ] && break
  sleep 0.1
done
[ -n "$address" ] || { echo "the server did not start:" >&2; cat "$log" >&2; exit 1; }
node "$build/web/gateway.mjs" --server "$address" "$@" &
gateway=$!
# Ctrl-C reaches both; whichever ends first ends the other.
trap 'kill -TERM $gateway $server 2>/dev/null; wait 2>/dev/null || true' EXIT
wait -n || true
