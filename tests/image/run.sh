#!/usr/bin/env bash
# Builds the container image, starts it and renders one scene through it. With a Docker engine nothing else is needed.
# Without one: buildah and debootstrap, as root; the base images are made from Debian's packages and this machine's
# Rust toolchain, and nothing is pulled.
set -euo pipefail
cd "$(dirname "$0")/../.."

port=${PORT:-18090}
work=$(mktemp -d)
scene='{"nephroid":1,"image":{"width":64,"height":48},"camera":{"type":"perspective","eye":[0,2.4,4.2],"target":[0,0.2,0],"fov":36},"materials":{"floor":{"type":"diffuse","albedo":[0.7,0.7,0.7]},"glass":{"type":"glass","ior":1.5}},"objects":[{"type":"polygon","vertices":[[-3,0,3],[3,0,3],[3,0,-3],[-3,0,-3]],"material":"floor"},{"type":"sphere","center":[0,0.55,0],"radius":0.5,"material":"glass"}],"lights":[{"type":"point","position":[1,3,1],"intensity":[5,5,5]}],"render":{"stop":{"rounds":4}}}'

# Renders a scene through the service on $port, once it is ready.
try() {
  for _ in $(seq 300); do curl -sf "http://127.0.0.1:$port/readyz" > /dev/null && break; sleep 0.1; done
  curl -sf "http://127.0.0.1:$port/v1/renders" -H 'Content-Type: application/json' -H 'Prefer: wait=30' -d "$scene" > "$work/job"
  image=$(sed 's/.*"image":"\([^"]*\)".*/\1/' "$work/job")
  curl -sf "http://127.0.0.1:$port$image" -o "$work/image.png"
  head -c 4 "$work/image.png" | grep -q PNG
  echo "image: a scene was rendered through the container, $(stat -c %s "$work/image.png") bytes of PNG"
}

if docker info > /dev/null 2>&1; then
  trap 'docker rm -f nephroid-try > /dev/null 2>&1 || true; rm -rf "$work"' EXIT
  docker build -t nephroid .
  docker run -d --name nephroid-try --read-only --cap-drop ALL -e NEPHROID_OPEN=true -p "127.0.0.1:$port:8080" nephroid > /dev/null
  try
  exit
fi

for tool in buildah debootstrap; do
  command -v "$tool" > /dev/null || { echo "make image: there is no Docker engine, and $tool is missing" >&2; exit 1; }
done
# Plain copies and chroot need no privileges beyond root's, so that this works inside a container, too.
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot
# buildah does not pass a signal on: the service is the last of its descendants.
stop() {
  local last=$server child
  while child=$(pgrep -P "$last" | head -1) && [ -n "$child" ]; do last=$child; done
  kill "$last" && wait "$server" || true
}
trap '[ -z "${server:-}" ] || stop
      [ -z "${container:-}" ] || buildah rm "$container" > /dev/null 2>&1 || true
      rm -rf "$work"' EXIT

# An image from Debian's packages: its name, and packages beyond the least.
base() {
  buildah images -q "$1" 2> /dev/null | grep -q . && return
  debootstrap --variant=minbase --include="$2" bookworm "$work/root" "${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' | head -1)}"
  rm -rf "$work/root/var/cache/apt/archives" "$work/root/var/lib/apt/lists"
  local empty; empty=$(buildah from scratch)
  buildah copy -q "$empty" "$work/root" / > /dev/null
  buildah commit -q --rm "$empty" "$1" > /dev/null
  rm -rf "$work/root"
}
base localhost/nephroid-base ca-certificates
base localhost/nephroid-build ca-certificates,gcc,libc6-dev

# The toolchain, the packages that were fetched already, and what an earlier build left.
cargo_home=${CARGO_HOME:-$HOME/.cargo}
rustup_home=${RUSTUP_HOME:-$HOME/.rustup}
cargo fetch --locked
mkdir -p target/image
toolchain=$(buildah from localhost/nephroid-build)
for pair in "CARGO_HOME=$cargo_home" "RUSTUP_HOME=$rustup_home" CARGO_NET_OFFLINE=true ${BUILD_ENV:-} \
  "PATH=$cargo_home/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"; do
  buildah config --env "$pair" "$toolchain"
done
buildah commit -q --rm "$toolchain" localhost/nephroid-toolchain > /dev/null
buildah bud --build-arg BUILD_IMAGE=localhost/nephroid-toolchain --build-arg BASE_IMAGE=localhost/nephroid-base \
  -v "$cargo_home:$cargo_home" -v "$rustup_home:$rustup_home" -v "$PWD/target/image:/src/target" \
  --format docker -t localhost/nephroid .

container=$(buildah from localhost/nephroid)
# The container shares this machine's network here, so loopback alone is listened on.
mkdir "$work/data" && chmod 777 "$work" "$work/data"
buildah run -v "$work/data:/data" --env NEPHROID_LISTEN="127.0.0.1:$port" "$container" -- nephroid-api &
server=$!
try
buildah run --env NEPHROID_LISTEN="127.0.0.1:$port" "$container" -- nephroid-api ready
buildah images localhost/nephroid
