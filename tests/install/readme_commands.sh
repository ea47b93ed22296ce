#!/usr/bin/env bash
# Runs the commands between the `commands:` marks of the README, on a scan of the simulator, as they
# stand there: in order, each must end well.
#   readme_commands.sh SOURCE BIN_DIR
set -euo pipefail
source=$1
bin=$2
root=$(mktemp -d)
mkdir -p "$root/build/release"
ln -s "$bin" "$root/build/release/bin"
cd "$root"
"$bin/rilievo" simulate star -o scan.ply --points 20000 --seed 2
"$bin/rilievo" simulate torus -o other.ply --points 5000 --seed 3

# The server takes a free port instead of the README's, and is waited for.
sed -n '/<!-- commands: begin -->/,/<!-- commands: end -->/s/^    //p' "$source/README.md" >commands
[ "$(wc -l <commands)" -gt 10 ] || { echo "the README has no commands" >&2; exit 1; }
port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
sed -i "s/50051/$port/g" commands
sed -i 's/^\(rilievod .*\) &$/\1 >server.log 2>\&1 \& server=$!; until grep -q listening server.log; do kill -0 $server; sleep 0.1; done/' commands
echo 'kill $server; wait $server' >>commands
trap 'rm -rf "$root"' EXIT
bash -euo pipefail -x commands
for file in mesh.glb surface.dss surface.png surface.obj few.ply surfaces/scan.dss surfaces/other.dss \
  aligned/view_1.ply star.dss \
  turning.png error.png; do
  [ -s "$file" ] || { echo "the commands left no $file" >&2; exit 1; }
done
# Pictures, files and folders the README points to are there.
grep -o '](\([^)#:]*\)' "$source/README.md" | sed 's/^](//' | sort -u | while read -r link; do
  [ -e "$source/$link" ] || { echo "the README points to $link, which does not exist" >&2; exit 1; }
done
