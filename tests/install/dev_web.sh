#!/usr/bin/env bash
# `./dev web` hands its words on to `rilievo view --open`, with one --listen. What it would install
# and build is taken as done.
#   dev_web.sh SOURCE_DIR
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder"/{path,client/web,build/release/bin}
cp "$1/dev" "$folder/dev"
touch "$folder/build/release/build.ninja"

program() {
  printf '#!/bin/sh\n%s\n' "$2" >"$folder/$1"
  chmod +x "$folder/$1"
}
for name in cmake node npm; do program "path/$name" 'exit 0'; done
program path/dpkg-query 'echo install ok installed'
program client/web/build.sh 'exit 0'
program build/release/bin/rilievo 'echo "$@"'

expect() {
  local want="view --open --store build/release/store $1" got
  shift
  got=$(PATH="$folder/path:$PATH" "$folder/dev" web "$@")
  [ "$got" = "$want" ] || { echo "./dev web $*: started '$got', not '$want'" >&2; exit 1; }
}
expect "--listen 127.0.0.1:8080"
expect "a.dss --listen 127.0.0.1:8080" a.dss
expect "--listen 127.0.0.1:9000 a.dss" --listen 127.0.0.1:9000 a.dss
expect "a.dss --listen=127.0.0.1:9000" a.dss --listen=127.0.0.1:9000
