#!/usr/bin/env bash
# From nothing to a reconstructed surface through a real server on loopback.
#   tests/demo.sh BIN_DIR OUTPUT_DIR
set -euo pipefail
bin=$1
out=$2
mkdir -p "$out"

"$bin/rilievod" --listen 127.0.0.1:0 >"$out/server.log" 2>&1 &
server=$!
trap 'kill -TERM $server 2>/dev/null; wait $server 2>/dev/null || true' EXIT
address=""
for _ in $(seq 100); do
  address=$(sed -n 's/.*listening on \([0-9.:]*\).*/\1/p' "$out/server.log" | head -1)
  [ -n "$address" ] && break
  sleep 0.1
done
[ -n "$address" ] || { echo "the server did not start:" >&2; cat "$out/server.log" >&2; exit 1; }
echo "server on $address"

"$bin/rilievo" simulate genus2 -o "$out/scan.ply" --points 100000 --noise 0.0005 --views 12 --seed 1
"$bin/rilievo" reconstruct "$out/scan.ply" -o "$out/surface.dss" --server "$address" \
  --report "$out/report.json"
"$bin/rilievo" export "$out/surface.dss" "$out/surface.ply"
"$bin/rilievo" compare "$out/surface.dss" "$out/scan.ply"
"$bin/rilievo" view "$out/surface.dss" -o "$out/surface.png"
echo "wrote $out/surface.dss, $out/surface.ply and $out/surface.png"
