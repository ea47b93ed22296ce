#!/usr/bin/env bash
# The protocol by buf (lint, and nothing broken since the release kept in proto/released.binpb) and by
# protoc for Go, Java and C#, the Kubernetes manifests by the schemas of its API, the compose files by
# the one of the Compose Specification, the recipes for continuous integration by running them, and the
# options that manifests, compose file and image give
# to the server by the server itself.
#   check.sh SOURCE WORK RILIEVOD
# Exit code 77: the tools cannot be had here.
set -euo pipefail
source=$(realpath "$1") rilievod=$(realpath "$3")
work=$2
failed=0

skip() {
  echo "SKIPPED: $1"
  exit 77
}
check() { # NAME COMMAND...
  local name=$1 said
  shift
  if said=$("$@" 2>&1); then
    echo "ok      $name"
  else
    echo "FAILED  $name"
    sed 's/^/  /' <<<"$said"
    failed=1
  fi
}
not() { ! "$@"; }

command -v npm >/dev/null || skip "npm is not installed"
command -v protoc-gen-go >/dev/null || skip "protoc-gen-go is not installed (protoc-gen-go-1-5)"
mkdir -p "$work"
cp "$source"/tests/schemas/package{,-lock}.json "$work"
[ -x "$work/node_modules/.bin/buf" ] && cmp -s "$source/tests/schemas/package-lock.json" "$work/installed" ||
  (cd "$work" && npm install --no-audit --no-fund --silent && cp package-lock.json installed) ||
  skip "npm cannot fetch what tests/schemas/package.json names"
buf=$work/node_modules/.bin/buf
modules=$(realpath "$work")
manifests=("$source"/deploy/kubernetes/*.yaml)

cd "$source/proto"
check "buf lint" "$buf" lint
check "buf breaking, since the last release" "$buf" breaking --against released.binpb

# Checks that cannot fail are none: a field that changes its number, a name against the rules, a wrong
# type and a name that does not exist must be found.
cp -r "$source/proto" "$work/changed"
trap 'rm -rf "$work/changed"' EXIT
sed -i 's/uint64 point_count = 1;/uint64 pointCount = 91;/' "$work/changed/rilievo/v1/reconstruction.proto"
cd "$work/changed"
check "buf lint finds a wrong name" not "$buf" lint
check "buf breaking finds a field that moved" not "$buf" breaking --against released.binpb

# Clients in other languages. A module path of Go cannot be guessed: without go_package there is no code.
languages() { # PROTOS
  rm -rf "$work/generated" && mkdir -p "$work"/generated/{go,java,csharp} && cd "$1" &&
    protoc -I . --go_out="$work/generated/go" --java_out="$work/generated/java" \
      --csharp_out="$work/generated/csharp" $(find . -name '*.proto' -printf '%P\n')
}
work=$(realpath "$work")
check "protoc for Go, Java and C#" languages "$source/proto"
for made in go/rilievo.dev/gen/rilievo/v1/jobs.pb.go java/dev/rilievo/v1/Job.java csharp/Jobs.cs; do
  check "protoc made $made" test -s "$work/generated/$made"
done
check "the C# is in its namespace" grep -q '^namespace Rilievo.V1' "$work/generated/csharp/Jobs.cs"
sed -i '/go_package/d' "$work/changed/rilievo/v1/jobs.proto"
check "protoc for Go refuses a file without go_package" not languages "$work/changed"

cd "$source"
check "manifests match the schemas" \
  node tests/schemas/check_manifests.mjs "$modules" "${manifests[@]}"
for change in 's/containerPort: 50051/containerPort: fifty/' 's/startupProbe/startProbe/' \
  's/targetPort: grpc/targetPort: grcp/'; do
  sed "$change" "${manifests[@]}" >"$work/changed/wrong.yaml"
  check "a manifest with $change is refused" \
    not node tests/schemas/check_manifests.mjs "$modules" "$work/changed/wrong.yaml"
done

check "the compose file matches the schema" \
  node tests/schemas/check_compose.mjs "$modules" docker/compose.yaml
for change in 's/read_only: true/readonly: true/' 's/retries: 3/retries: often/' 's/^  store:$/  stor:/'; do
  sed "$change" docker/compose.yaml >"$work/changed/wrong.yaml"
  check "a compose file with $change is refused" \
    not node tests/schemas/check_compose.mjs "$modules" "$work/changed/wrong.yaml"
done

check "the compose file of one scan matches the schema" \
  node tests/schemas/check_compose.mjs "$modules" deploy/ci/compose.yaml
# The name that release/make.sh gives to an image.
image=$(sed -n 's/.* -t "\([^"]*\)" .*/\1/p' release/make.sh)
image=${image//\$name/rilievo}
image=${image//\$version/$(sed -n 's/^project(.* VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)}
check "its image is $image, as a release names it" grep -qxF "    image: $image" deploy/ci/compose.yaml

# The recipes for continuous integration, as their services run them: a scan like its reference passes, a
# changed one ends with 7.
bin=$(dirname "$rilievod")
rm -rf "$work/ci" && mkdir "$work/ci"
for scan in "reference --noise 0.001" "same --noise 0.001 --seed 2" "changed --noise 0.02"; do
  # shellcheck disable=SC2086  # a name and options
  "$bin/rilievo" simulate star -o "$work/ci/${scan%% *}.ply" --points 5000 ${scan#* } >/dev/null
done
"$bin/rilievo" reconstruct "$work/ci/reference.ply" -o "$work/ci/reference.dss" --quiet >/dev/null
ends_with() { # CODE FILE SCAN
  local code=0
  node tests/schemas/script_of.mjs "$modules" "$2" >"$work/ci/commands"
  (cd "$work/ci" && PATH=$bin:$PATH SCAN=$3 REFERENCE=reference.dss MAX_RMS=0.001 SURFACE=surface.dss \
    bash -e commands) || code=$?
  [ "$code" -eq "$1" ] || { echo "ended with $code, not $1"; return 1; }
}
for recipe in action.yml gitlab.yml; do
  check "$recipe passes a scan like its reference" ends_with 0 "deploy/ci/$recipe" same.ply
  check "$recipe ends with 7 at a changed scan" ends_with 7 "deploy/ci/$recipe" changed.ply
done
mapfile -t once < <(node tests/schemas/container_arguments.mjs "$modules" deploy/ci/compose.yaml reconstruct)
check "the command of the compose file makes a mesh" \
  sh -c 'cd "$1/ci" && cp same.ply scan.ply && shift && "$@" && test -s mesh.glb' sh "$work" "$bin/rilievo" "${once[@]}"

# What the image is built with comes to it past .dockerignore.
for script in $(grep -o 'docker/[a-z_]*\.sh' docker/Dockerfile | sort -u); do
  check "the image is built with $script" grep -qx "!$script" .dockerignore
done

# The server's own judgement of the options it would be started with; it makes a token instead.
arguments() {
  node tests/schemas/container_arguments.mjs "$modules" "$1"
}
for file in "${manifests[@]}" docker/compose.yaml docker/Dockerfile deploy/front/{compose,kubernetes}.yaml; do
  mapfile -t options < <(arguments "$file")
  [ ${#options[@]} -gt 1 ] || options=(--no-options-found-in="$file")
  # Without the tokens of the file: the line goes to standard error.
  mapfile -t options < <(printf '%s\n' "${options[@]}" | grep -v '^--tokens=')
  check "rilievod takes the options of $file" "$rilievod" "${options[@]}" --make-token x
done

# A fleet. The orchestrator puts the store's address in.
check "the fleet's manifests match the schemas" \
  node tests/schemas/check_manifests.mjs "$modules" deploy/fleet/kubernetes.yaml
check "the fleet's compose file matches the schema" \
  node tests/schemas/check_compose.mjs "$modules" deploy/fleet/compose.yaml
check "the fleet's compose file with a front matches the schema" \
  node tests/schemas/check_compose.mjs "$modules" deploy/fleet/front.yaml
for part in kubernetes.yaml:rilievod kubernetes.yaml:rilievo-worker compose.yaml:server \
  compose.yaml:second-server compose.yaml:worker front.yaml:server front.yaml:second-server; do
  file=deploy/fleet/${part%:*}
  mapfile -t options < <(node tests/schemas/container_arguments.mjs "$modules" "$file" "${part#*:}" |
    sed 's,\$(RILIEVO_STORE),postgres://rilievo@db/rilievo,; /^--tokens=/d')
  [ ${#options[@]} -gt 1 ] || options=(--no-options-found-in="$part")
  check "rilievod takes the options of $part" "$rilievod" "${options[@]}" --make-token x
done
check "the Slurm script is one" bash -n deploy/fleet/rilievo-workers.sbatch
exit $failed
