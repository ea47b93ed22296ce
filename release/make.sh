#!/usr/bin/env bash
# Makes what a release consists of, from a finished build and its viewer: Debian packages, a wheel,
# the npm package, the add-on for Blender, images of the server and of the command as OCI archives, a
# bill of materials and checksums. The same build gives the same bytes each time: all times are that of the commit.
# As root on Debian 12, whose libraries go into the images.
#   release/make.sh BUILD DIST
set -euo pipefail
umask 022
build=$(realpath "$1")
dist=$(realpath -m "$2")
cd "$(dirname "$0")/.."
[ "$(id -u)" -eq 0 ] || { echo "release: the images are made as root only" >&2; exit 1; }

version=$(sed -n 's/^project(.* VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
for file in client/python/{pyproject.toml,rilievo/__init__.py} client/web/{,npm/}package.json; do
  grep -qE "version(__)?\"?[ :=]+\"$version\"" "$file" || { echo "release: $file is not of version $version" >&2; exit 1; }
done
architecture=$(dpkg --print-architecture)
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
revision=$(git rev-parse HEAD)
git diff --quiet HEAD || revision+=-changed
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rm -rf "$dist"
mkdir -p "$dist"

debian_packages() {
  (cd "$build" && cpack -G DEB -B "$work/deb") >"$work/deb.log" 2>&1 || { cat "$work/deb.log" >&2; exit 1; }
  cp "$work"/deb/*.deb "$dist"
}

# Its library must run where nothing of Debian is: of shared libraries it may need those of C and C++.
wheel() {
  local library=$work/librilievo_decoder.so needed
  strip --strip-unneeded -o "$library" "$build/lib/bundled/librilievo_decoder.so"
  needed=$(readelf -d "$library" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
  if grep -vE '^(libc\.so\.6|libm\.so\.6|libstdc\+\+\.so\.6|libgcc_s\.so\.1|ld-linux.*)$' <<<"$needed"; then
    echo "release: the decoder of the wheel must not need these" >&2
    exit 1
  fi
  # Beside the sources nothing is left behind.
  mkdir -p "$work/wheel/client"
  cp -r proto "$work/wheel/"
  cp -r client/python "$work/wheel/client/"
  RILIEVO_DECODER_LIBRARY=$library /usr/bin/python3 -m pip -q wheel --no-deps --no-index \
    --no-build-isolation -w "$dist" "$work/wheel/client/python"
}

npm_package() {
  client/web/npm/build.sh "$build"
  npm pack --silent --pack-destination "$dist" "$build/web/npm" >/dev/null
}

# As Blender installs add-ons.
blender_addon() {
  /usr/bin/python3 - client/blender rilievo_blender "$dist/rilievo-blender-$version.zip" <<'PYTHON'
import os, pathlib, sys, time, zipfile
root, name, path = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as addon:
    for file in sorted((root / name).rglob("*.py")):
        entry = zipfile.ZipInfo(str(file.relative_to(root)), time.gmtime(int(os.environ["SOURCE_DATE_EPOCH"]))[:6])
        entry.external_attr = 0o644 << 16
        addon.writestr(entry, file.read_bytes(), zipfile.ZIP_DEFLATED)
PYTHON
}

image() { # NAME DOCKERFILE PROGRAM...
  local name=$1 dockerfile=$2 context=$work/$1 storage=(--root "$work/storage" --runroot "$work/run")
  shift 2
  mkdir -p "$context" "$work/oci"
  docker/collect_runtime.sh "$context/libraries" "$context/program" "${@/#/$build/bin/}" >"$work/log"
  install -D -m 644 LICENSE "$context/program/usr/share/doc/rilievo/copyright"
  docker/software_bill.sh "$context/libraries" "$("$build/bin/$1" --version)" \
    >"$context/program/usr/share/doc/rilievo/sbom.spdx.json"
  cp "$context/program/usr/share/doc/rilievo/sbom.spdx.json" "$work/$name.spdx.json"
  install -d -m 700 "$context/store/rilievo"
  install -d -m 1777 "$context/scratch/tmp" "$context/scratch/data"
  # The stage that makes the image; what it copies from the stage before lies in the context.
  sed -n '/^FROM scratch/,$p' "$dockerfile" | sed 's/--from=build //; s, /runtime/, ,' >"$context/Dockerfile"
  buildah "${storage[@]}" --storage-driver overlay bud --quiet --isolation chroot --format oci \
    --timestamp "$SOURCE_DATE_EPOCH" --build-arg VERSION="$version" --build-arg REVISION="$revision" \
    -t "localhost/$name:$version" "$context" >"$work/log" 2>&1 || { cat "$work/log" >&2; exit 1; }
  buildah "${storage[@]}" --storage-driver overlay push --quiet "localhost/$name:$version" \
    "oci:$work/oci/$name:localhost/$name:$version" >"$work/log"
  tar --sort=name --mtime="@$SOURCE_DATE_EPOCH" --owner=0 --group=0 --numeric-owner --mode=u=rwX,go=rX \
    -cf "$dist/$name-$version-$architecture.oci.tar" -C "$work/oci/$name" blobs index.json oci-layout
}

debian_packages
wheel
npm_package
blender_addon
image rilievod docker/Dockerfile rilievod rilievo-worker
image rilievo docker/cli.Dockerfile rilievo rilievo-worker
/usr/bin/python3 release/bill_of_materials.py "$version" "$revision" "$dist" \
  client/web/package-lock.json "$work" >"$dist/rilievo-$version.spdx.json"
(cd "$dist" && sha256sum -- * >"$work/SHA256SUMS" && cp "$work/SHA256SUMS" SHA256SUMS)
