#!/usr/bin/env bash
# The checks in the fresh system of release_test.sh: /dist, /project (the sources, nothing built), /node (the npm
# package and three.js).
set -euo pipefail
source /project/tests/release/checks.sh
cd "$(mktemp -d)"
golden=/project/tests/golden/torus_in_groups_v3.dss
export DEBIAN_FRONTEND=noninteractive HOME=$PWD LC_ALL=C.UTF-8

# SHA-256 of the vertices and faces of the frozen surface, and where the decoder was loaded from.
cat >read.py <<'PYTHON'
import hashlib, sys, rilievo, rilievo._library
mesh = rilievo.read(sys.argv[1]).mesh()
print(hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest())
print(rilievo._library.library()._name, rilievo.__version__)
PYTHON
cat >reconstruct.py <<'PYTHON'
import numpy, rilievo
points = numpy.random.default_rng(1).normal(size=(3000, 3))
points /= numpy.linalg.norm(points, axis=1)[:, None]
surface = rilievo.reconstruct(points)
assert abs(numpy.linalg.norm(surface.vertices(), axis=1).mean() - 1) < 0.01
PYTHON

# The wheel, before any package of ours is there.
check "no decoder is installed yet" test -z "$(ldconfig -p | grep rilievo)"
check "the wheel is for a platform" test -n "$(ls /dist/rilievo-*-py3-none-manylinux_*.whl)"
check "a virtual environment takes the wheel" quietly sh -c \
  "python3 -m venv --system-site-packages env && env/bin/pip install --no-index /dist/rilievo-*.whl"
check "Python reads a surface with the wheel alone" quietly sh -c "env/bin/python read.py $golden >of_wheel"
check "its decoder is the one in the wheel" grep -q "$PWD/env/.*/librilievo_decoder.so" of_wheel

check "apt installs the packages" quietly sh -c \
  "apt-get update -qq && apt-get install -y -qq --no-install-recommends -o Dpkg::Options::=--force-unsafe-io /dist/*.deb"
version=$(dpkg-query -W -f='${Version}' rilievo)
check "rilievo tells its version" test "$(rilievo --version)" = "rilievo $version"
check "manual pages are there" test -s /usr/share/man/man1/rilievo.1 -a -s /usr/share/man/man8/rilievod.8
check "the commands of the README" quietly bash /project/tests/install/readme_commands.sh /project /usr/bin

check "Debian's Python reads a surface" quietly sh -c "python3 read.py $golden >of_package"
check "its decoder is the installed one" grep -q '^librilievo_decoder.so.1 ' of_package
check "with the same bits as the wheel" test "$(head -1 of_wheel)" = "$(head -1 of_package)"
check "Python reconstructs by a server of its own" quietly python3 reconstruct.py

# shellcheck disable=SC2046  # several words
check "a C program by pkg-config" quietly cc -o decode /project/tests/decoder/decode_from_c.c \
  $(pkg-config --cflags --libs rilievo-decoder-c)
check "decodes" test "$(./decode /project/tests/golden/sheet_and_octahedron_v2.dss 3 | grep -c '^v ')" = 1562
check "a C++ program by CMake" quietly sh -c \
  "cmake -S /project/examples/reconstruct -B example -DCMAKE_BUILD_TYPE=Release && cmake --build example"
check "reconstructs" grep -q '^genus 1, ' <<<"$(example/reconstruct)"

check "Node decodes, and three.js gets level after level" quietly node /node/loader.mjs $golden
rilievo view $golden --open --listen 127.0.0.1:0 >page 2>&1 &
viewer=$!
for _ in $(seq 100); do
  ! grep -q http page || break
  sleep 0.1
done
check "the viewer serves its page" grep -q '<title>' <<<"$(python3 -c '
import re, sys, urllib.request
address = re.search(r"http://\S+", open("page").read())[0].partition("#")[0]
print(urllib.request.urlopen(address).read().decode())')"
kill -INT $viewer
wait $viewer || true
echo "$passed" >/passed
[ "$failed" -eq 0 ]
