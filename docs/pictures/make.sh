#!/usr/bin/env bash
# Makes the pictures of the README again: a scan of the simulator and what becomes of it, stage by stage.
#   docs/pictures/make.sh BIN_DIR [OUTPUT_DIR]
set -euo pipefail
bin=$(cd "$1" && pwd)
out=${2:-$(cd "$(dirname "$0")" && pwd)}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$out"

"$bin/rilievo" simulate star -o "$work/scan.ply" --points 60000 --views 3 --dropout 0.3 --seed 4
"$bin/rilievo" reconstruct "$work/scan.ply" -o "$work/surface.dss" --control-faces 400 \
  --topology arbitrary --boundary close --quiet
draw() { # NAME INPUT OPTIONS...
  local name=$1 input=$2
  shift 2
  "$bin/rilievo" view "$work/$input" -o "$out/$name.png" --turn 20 --elevation 20 "$@"
}
draw surface surface.dss --size 560x420
draw 1-points scan.ply --size 320x240
draw 2-control-mesh surface.dss --size 320x240 --show control-mesh --flat --edges
draw 3-smooth-surface surface.dss --size 320x240 --show domain
draw 4-displaced-surface surface.dss --size 320x240
draw 5-displacement surface.dss --size 320x240 --colors displacement
draw 6-flags surface.dss --size 320x240 --colors flags
