# Shared by the scripts beside it: starts and stops the service, and has a scene of a wanted cost.
# shellcheck shell=bash

bin=target/release
work=$(mktemp -d)
trap '[ -z "${server:-}" ] || kill "$server" 2>/dev/null || true; rm -rf "$work"' EXIT

# Starts the service with these flags on a free port; sets $server and $api.
start() {
  rm -rf "$work/data" "$work/out"
  NEPHROID_LOG=warn "$bin/nephroid-api" --listen 127.0.0.1:0 --data "$work/data" "$@" > "$work/out" &
  server=$!
  until grep -qs listening "$work/out"; do kill -0 "$server"; sleep 0.05; done
  api=$(sed 's/listening on //' "$work/out")
}
stop() { kill "$server"; wait "$server" || true; server=; }

# Width, height, rounds.
scene() { printf '{"nephroid":1,"image":{"width":%d,"height":%d},"camera":{"type":"perspective","eye":[0,2.4,4.2],"target":[0,0.2,0],"fov":36},"materials":{"floor":{"type":"diffuse","albedo":[0.7,0.7,0.7]},"glass":{"type":"glass","ior":1.5}},"objects":[{"type":"polygon","vertices":[[-3,0,3],[3,0,3],[3,0,-3],[-3,0,-3]],"material":"floor"},{"type":"sphere","center":[0,0.55,0],"radius":0.5,"material":"glass"}],"lights":[{"type":"point","position":[1,3,1],"intensity":[5,5,5]}],"render":{"stop":{"rounds":%d}}}' "$1" "$2" "$3"; }
# A scene, and what else curl should send.
submit() { curl -sf "$api/v1/renders" -H 'Content-Type: application/json' -d "$@" | sed 's/.*"id":"\([^"]*\)".*/\1/'; }
finished() { until curl -sf "$api/v1/renders/$1" | grep -q '"done":true'; do sleep 0.05; done; }
