#!/usr/bin/env bash
# Builds the container image, starts it as compose.yaml does (read-only root, no capabilities) and renders one scene
# through it. With a Docker engine nothing else is needed. Without one: buildah and debootstrap, as root; the base images
# are made from Debian's packages and this machine's Rust toolchain, and nothing is pulled.
set -euo pipefail
cd "$(dirname "$0")/../.."

port=${PORT:-18090}
# What an image of two programs on a small Debian needs, and no more.
most_bytes=200000000
work=$(mktemp -d)
scene='{"nephroid":1,"image":{"width":64,"height":48},"camera":{"type":"perspective","eye":[0,2.4,4.2],"target":[0,0.2,0],"fov":36},"materials":{"floor":{"type":"diffuse","albedo":[0.7,0.7,0.7]},"glass":{"type":"glass","ior":1.5}},"objects":[{"type":"polygon","vertices":[[-3,0,3],[3,0,3],[3,0,-3],[-3,0,-3]],"material":"floor"},{"type":"sphere","center":[0,0.55,0],"radius":0.5,"material":"glass"}],"lights":[{"type":"point","position":[1,3,1],"intensity":[5,5,5]}],"render":{"stop":{"rounds":4}}}'

fail() { echo "make image: $*" >&2; exit 1; }

# Holds the running container against what the image promises. `inside COMMAND` runs a command beside the service,
# `health` the image's own health check, `size` prints its bytes.
try() {
  for _ in $(seq 300); do curl -sf "http://127.0.0.1:$port/readyz" > /dev/null && break; sleep 0.1; done
  curl -sf "http://127.0.0.1:$port/readyz" > /dev/null || fail "the service does not become ready"
  health || fail "the health check fails while the service is ready"
  [ "$(inside id -u)" != 0 ] || fail "the service is root"
  inside touch /data/written || fail "the data folder cannot be written"
  for place in / /etc /usr/local/bin /home /tmp; do
    ! inside touch "$place/written" 2> /dev/null || fail "$place can be written"
  done
  curl -sf "http://127.0.0.1:$port/v1/renders" -H 'Content-Type: application/json' -H 'Prefer: wait=30' -d "$scene" > "$work/job"
  image=$(sed 's/.*"image":"\([^"]*\)".*/\1/' "$work/job")
  curl -sf "http://127.0.0.1:$port$image" -o "$work/image.png"
  head -c 4 "$work/image.png" | grep -q PNG
  [ "$(size)" -lt "$most_bytes" ] || fail "the image has $(size) bytes"
  echo "image: $(($(size) / 1000000)) MB; healthy, not root, nothing but /data can be written; a scene was rendered, $(stat -c %s "$work/image.png") bytes of PNG"
}

if docker info > /dev/null 2>&1; then
  trap 'docker rm -f nephroid-try > /dev/null 2>&1 || true; rm -rf "$work"' EXIT
  docker build -t nephroid .
  docker run -d --name nephroid-try --read-only --cap-drop ALL --security-opt no-new-privileges \
    -e NEPHROID_OPEN=true -p "127.0.0.1:$port:8080" nephroid > /dev/null
  inside() { docker exec nephroid-try "$@"; }
  health() {
    for _ in $(seq 300); do
      [ "$(docker inspect --format '{{.State.Health.Status}}' nephroid-try)" = healthy ] && return
      sleep 0.1
    done
    return 1
  }
  size() { docker image inspect --format '{{.Size}}' nephroid; }
  try
  docker stop nephroid-try > /dev/null
  [ "$(docker inspect --format '{{.State.ExitCode}}' nephroid-try)" = 0 ] || fail "the service did not end well"
  exit
fi

for tool in buildah debootstrap; do
  command -v "$tool" > /dev/null || fail "there is no Docker engine, and $tool is missing"
done
# Plain copies and chroot need no privileges beyond root's, so that this works inside a container, too.
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot
trap '[ -z "${server:-}" ] || kill "$server" 2> /dev/null || true
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

# buildah runs nothing on a read-only root. What an engine does with `--read-only --cap-drop ALL` is done here: the image's
# files are mounted read-only but for /data, and its command runs there as its user, without a way to more rights.
container=$(buildah from localhost/nephroid)
root=$(buildah mount "$container")
configured() { buildah inspect --type image --format "$1" localhost/nephroid; }
user=$(configured '{{.Docker.Config.User}}')
ids=$(awk -F: -v user="$user" '$1 == user { print $3 ":" $4 }' "$root/etc/passwd")
[ -n "$ids" ] || fail "the image has no user $user"
mapfile -t environment < <(configured '{{range .Docker.Config.Env}}{{println .}}{{end}}' | grep .)
mkdir "$work/data" && chown "$ids" "$work/data"
enter() {
  # shellcheck disable=SC2016  # these are the arguments of the inner shell
  exec unshare --mount --propagation private bash -euc '
    root=$1 data=$2 ids=$3; shift 3
    mount --bind "$root" "$root"
    mount --bind "$data" "$root/data"
    mount --rbind /dev "$root/dev"
    mount -o remount,bind,ro "$root"
    exec setpriv --no-new-privs chroot --userspec="$ids" "$root" /usr/bin/env -i "$@"
  ' inner "$root" "$work/data" "$ids" "${environment[@]}" NEPHROID_LISTEN="127.0.0.1:$port" "$@"
}
inside() { (enter "$@"); }
health() {
  local check; check=$(configured '{{range .Docker.Config.Healthcheck.Test}}{{print . " "}}{{end}}')
  # shellcheck disable=SC2086  # a command and its arguments
  [[ $check == CMD\ * ]] && inside ${check#CMD }
}
size() { du -sb --exclude=./data "$root" | cut -f1; }
# shellcheck disable=SC2046  # a command and its arguments
enter $(configured '{{range .Docker.Config.Cmd}}{{print . " "}}{{end}}') &
server=$!
try
kill "$server"
wait "$server" || fail "the service did not end well"
server=
