#!/usr/bin/env bash
# Load on loopback: submissions that are on disk when they are answered, and questions about a job, with an idle
# renderer and while all cores render. Prints requests per second and the 99th percentile. Takes about a minute.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v wrk >/dev/null || { echo "make load: wrk is missing (Debian: apt-get install wrk)" >&2; exit 1; }

seconds=${SECONDS_EACH:-10}
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

# One line of a wrk report.
report() { awk -v what="$1" '/99%/ { p99 = $2 } /Requests\/sec/ { rate = $2 } /Non-2xx/ { bad = $NF }
  END { printf "%-58s %9.0f /s   p99 %s%s\n", what, rate, p99, bad ? "   not 2xx: " bad : "" }'; }

scene() { printf '{"nephroid":1,"image":{"width":%d,"height":%d},"camera":{"type":"perspective","eye":[0,2.4,4.2],"target":[0,0.2,0],"fov":36},"materials":{"floor":{"type":"diffuse","albedo":[0.7,0.7,0.7]},"glass":{"type":"glass","ior":1.5}},"objects":[{"type":"polygon","vertices":[[-3,0,3],[3,0,3],[3,0,-3],[-3,0,-3]],"material":"floor"},{"type":"sphere","center":[0,0.55,0],"radius":0.5,"material":"glass"}],"lights":[{"type":"point","position":[1,3,1],"intensity":[5,5,5]}],"render":{"stop":{"rounds":%d}}}' "$1" "$2" "$3"; }
submit() { curl -sf "$api/v1/renders" -H 'Content-Type: application/json' -d "$1" | sed 's/.*"id":"\([^"]*\)".*/\1/'; }

cat > "$work/post.lua" <<LUA
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
wrk.body = [=[$(scene 64 64 1)]=]
LUA

# The renderer is idle: nothing is taken from the queue.
start --concurrent 0 --queue 10000000
wrk -t1 -c128 -d"${seconds}s" --latency -s "$work/post.lua" "$api/v1/renders" | report "POST /v1/renders, durable, 128 connections"
id=$(submit "$(scene 64 64 1)")
wrk -t1 -c64 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET /v1/renders/{id}, waiting job, 64 connections"
stop

start
id=$(submit "$(scene 64 64 1)")
until curl -sf "$api/v1/renders/$id" | grep -q '"done":true'; do sleep 0.05; done
wrk -t1 -c64 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET /v1/renders/{id}, finished job, 64 connections"
busy=$(submit "$(scene 800 600 1000000)")
until curl -sf "$api/v1/renders/$busy" | grep -q '"state":"running"'; do sleep 0.05; done
# A few clients that ask as people do: what counts is how long they wait.
wrk -t1 -c4 -d"${seconds}s" --latency "$api/v1/renders/$busy" | report "GET of the running job while all cores render, 4 conn."
wrk -t1 -c4 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET of a finished job while all cores render, 4 conn."
curl -sf -X POST "$api/v1/renders/$busy/cancel" > /dev/null

# What the service costs over the command: the same scene and rounds, user and system time.
small=$(scene 64 64 1)
for _ in 1 2 3 4 5; do
  curl -sf -o /dev/null -w '%{time_total}\n' "$api/v1/renders" -H 'Content-Type: application/json' -H 'Prefer: wait=30' -d "$small"
done | sort -n | awk '{ t[NR] = $1 } END { printf "%-58s %9.1f ms (median of 5)\n", "64×64 over HTTP, submitted and waited for", 1000 * t[3] }'
printf '%s' "$small" > "$work/small.json"
for _ in 1 2 3 4 5; do
  start_ns=$(date +%s%N); "$bin/nephroid" render "$work/small.json" -o "$work/small.png" --quiet; echo $(( $(date +%s%N) - start_ns ))
done | sort -n | awk '{ t[NR] = $1 } END { printf "%-58s %9.1f ms (median of 5)\n", "64×64 by the command", t[3] / 1e6 }'
stop

scene 200 150 "${ROUNDS:-16}" > "$work/long.json"
start
ticks() { awk '{ print $14 + $15 }' "/proc/$1/stat"; }
before=$(ticks "$server")
id=$(submit "$(cat "$work/long.json")")
until curl -sf "$api/v1/renders/$id" | grep -q '"done":true'; do sleep 0.2; done
service=$(( $(ticks "$server") - before ))
stop
command=$( { TIMEFORMAT='%U %S'; time "$bin/nephroid" render "$work/long.json" -o "$work/long.png" --quiet; } 2>&1 | awk '{ print 100 * ($1 + $2) }')
awk -v s="$service" -v c="$command" 'BEGIN { printf "%-58s %9.2f s against %.2f s: %+.1f %%\n", "CPU time of a long render, service against command", s / 100, c / 100, 100 * (s / c - 1) }'
