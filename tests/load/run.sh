#!/usr/bin/env bash
# Load on loopback: submissions that are on disk when they are answered, and questions about a job, with an idle
# renderer and while all cores render. Prints requests per second and the 99th percentile. Then what the
# service costs over the command. Takes about three minutes.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v wrk >/dev/null || { echo "make load: wrk is missing (Debian: apt-get install wrk)" >&2; exit 1; }

seconds=${SECONDS_EACH:-10}
. tests/load/service.sh

# One line of a wrk report.
report() { awk -v what="$1" '/99%/ { p99 = $2 } /Requests\/sec/ { rate = $2 } /Non-2xx/ { bad = $NF }
  END { printf "%-58s %9.0f /s   p99 %s%s\n", what, rate, p99, bad ? "   not 2xx: " bad : "" }'; }

cat > "$work/post.lua" <<LUA
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
wrk.body = [=[$(scene 64 64 1)]=]
LUA

# The renderer is idle: nothing is taken from the queue.
start --concurrent 0 --queue 10000000
wrk -t1 -c128 -d"${seconds}s" --latency -s "$work/post.lua" "$api/v1/renders" | report "POST /v1/renders, durable, 128 connections"
wrk -t1 -c32 -d"${seconds}s" --latency -s "$work/post.lua" "$api/v1/renders" | report "POST /v1/renders, durable, 32 connections"
id=$(submit "$(scene 64 64 1)")
wrk -t1 -c64 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET /v1/renders/{id}, waiting job, 64 connections"
stop

start
id=$(submit "$(scene 64 64 1)")
finished "$id"
wrk -t1 -c64 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET /v1/renders/{id}, finished job, 64 connections"
busy=$(submit "$(scene 800 600 1000000)")
until curl -sf "$api/v1/renders/$busy" | grep -q '"state":"running"'; do sleep 0.05; done
# A few clients that ask as people do: what counts is how long they wait.
wrk -t1 -c4 -d"${seconds}s" --latency "$api/v1/renders/$busy" | report "GET of the running job while all cores render, 4 conn."
wrk -t1 -c4 -d"${seconds}s" --latency "$api/v1/renders/$id" | report "GET of a finished job while all cores render, 4 conn."
curl -sf -X POST "$api/v1/renders/$busy/cancel" > /dev/null
stop

bash tests/load/overhead.sh
