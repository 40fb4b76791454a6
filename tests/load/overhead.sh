#!/usr/bin/env bash
# What the service costs over the command for the same scene: milliseconds of a small one, CPU time of one of about ten
# seconds. Both take turns, so that whatever else this machine does meets both alike; medians are compared.
set -euo pipefail
cd "$(dirname "$0")/../.."
. tests/load/service.sh

median() { sort -n | awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }'; }
small=$(scene 64 64 1)
printf '%s' "$small" > "$work/small.json"
start
for _ in $(seq "${TURNS:-21}"); do
  curl -sf -o /dev/null -w '%{time_total}\n' "$api/v1/renders" -H 'Content-Type: application/json' -H 'Prefer: wait=30' -d "$small" |
    awk '{ print 1000 * $1 }' >> "$work/http-ms"
  begun=$(date +%s%N)
  "$bin/nephroid" render "$work/small.json" -o "$work/small.png" --quiet
  echo "$begun $(date +%s%N)" | awk '{ print ($2 - $1) / 1e6 }' >> "$work/command-ms"
done
awk -v s="$(median < "$work/http-ms")" -v c="$(median < "$work/command-ms")" 'BEGIN {
  printf "64×64, one round: %.1f ms over HTTP until it is done, %.1f ms by the command: %+.1f ms\n", s, c, s - c }'

# As many rounds as the command makes in ten seconds.
scene 320 240 1000000 > "$work/long.json"
"$bin/nephroid" render "$work/long.json" -o "$work/long.png" --quiet --seconds "${SECONDS_LONG:-10}" --stats "$work/stats.json"
rounds=$(grep -o '"rounds": *[0-9]*' "$work/stats.json" | grep -o '[0-9]*$' | head -1)
scene 320 240 "$rounds" > "$work/long.json"
ticks() { awk '{ print $14 + $15 }' "/proc/$1/stat"; }
by_service() {
  local before id
  before=$(ticks "$server")
  # Asked for as clients should: a curl that starts twenty times a second would disturb what is measured.
  id=$(submit "$(cat "$work/long.json")" -H 'Prefer: wait=30')
  finished "$id"
  echo "$before $(ticks "$server") $(getconf CLK_TCK)" | awk '{ print ($2 - $1) / $3 }' >> "$work/service-s"
  curl -sf "$api/v1/renders/$id/image.png" -o "$work/service.png"
}
by_command() {
  { TIMEFORMAT='%U %S'; time "$bin/nephroid" render "$work/long.json" -o "$work/long.png" --quiet; } 2>&1 |
    awk '{ print $1 + $2 }' >> "$work/command-s"
}
# First the one, then the other: a machine that grows busier or hotter favours neither.
for _ in $(seq "${TURNS_LONG:-3}"); do
  by_service; by_command; by_command; by_service
  cmp "$work/service.png" "$work/long.png"
done
stop
awk -v s="$(median < "$work/service-s")" -v c="$(median < "$work/command-s")" -v rounds="$rounds" 'BEGIN {
  printf "320×240, %d rounds: %.2f s of CPU in the service, %.2f s by the command: %+.1f %%; the same bytes\n", rounds, s, c, 100 * (s / c - 1) }'
