#!/usr/bin/env bash
# What `./dev release` left, used by a stranger: a fresh Debian 12 in a folder, with the files of DIST
# and nothing else of this build, runs inside.sh; the images run by podman. As root.
#   tests/release/release_test.sh DIST
set -euo pipefail
dist=$(realpath "$1")
cd "$(dirname "$0")/../.."
[ "$(id -u)" -eq 0 ] || { echo "release_test: this needs root" >&2; exit 1; }
source docker/engine.sh
source tests/release/checks.sh

root=$(mktemp -d /var/tmp/rilievo-release.XXXXXX)
finish() {
  ! mountpoint -q "$root/system/proc" || umount "$root/system/proc"
  rm -rf "$root"
}
trap finish EXIT

make_system() {
  mmdebstrap --quiet --variant=minbase \
    --include=ca-certificates,gcc,g++,cmake,make,pkg-config,nodejs,python3-venv,python3-numpy,python3-grpcio,python3-protobuf \
    bookworm "$root/system"
  mount -t proc proc "$root/system/proc"
  cp -r "$dist" "$root/system/dist"
  # The README, examples and frozen surfaces; nothing that was built.
  mkdir "$root/system/project"
  git ls-files -z | xargs -0 cp --parents -t "$root/system/project"
  mkdir "$root/system/node"
  npm install --silent --no-audit --no-fund --prefix "$root/system/node" "$dist"/rilievo-decoder-*.tgz three@0.187.0
  cp tests/release/loader.mjs "$root/system/node/"
}

check_images() {
  local data=$root/data image version
  version=$(sed -n 's/^project(.* VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
  mkdir "$data"
  for name in rilievo rilievod; do
    image=localhost/$name:$version
    check "$name: the archive is an image" quietly "${engine[@]}" load -i "$dist/$name-$version-$(dpkg --print-architecture).oci.tar"
    check "$name: the image names version, revision and licence" test "$(
      "${engine[@]}" image inspect --format '{{range $key, $value := .Config.Labels}}{{$key}}={{$value}}
{{end}}' "$image" | grep -cE "image\.(version=$version|revision=[0-9a-f]{40}(-changed)?|licenses=Apache-2\.0)$")" = 3
  done
  run=("${engine[@]}" run --rm --read-only --cap-drop ALL "${bare_machine[@]}")
  check "the command in a container makes a scan" quietly \
    "${run[@]}" -v "$data:/data" "localhost/rilievo:$version" simulate star -o /data/s.ply --points 5000
  check "podman run IMAGE reconstruct" quietly \
    "${run[@]}" -v "$data:/data" "localhost/rilievo:$version" reconstruct /data/s.ply -o /data/s.glb
  check "and leaves a GLB" test "$(head -c 4 "$data/s.glb")" = glTF
  check "the server in a container tells its version" \
    grep -qx "rilievod $version" <<<"$("${run[@]}" "localhost/rilievod:$version" --version)"
  "${engine[@]}" image rm "localhost/rilievo:$version" "localhost/rilievod:$version" >/dev/null
}

check "the checksums are right" quietly sh -c "cd '$dist' && sha256sum --check --quiet SHA256SUMS"
check "the bill of materials names every file and what is in it" /usr/bin/python3 tests/release/check_bill.py "$dist"
echo "a fresh Debian 12, with compilers, Python and Node"
make_system
chroot "$root/system" bash /project/tests/release/inside.sh || failed=$((failed + 1))
[ ! -f "$root/system/passed" ] || passed=$((passed + $(cat "$root/system/passed")))
check_images
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
