#!/usr/bin/env bash
# Random requests made from the service's own OpenAPI document: no 5xx, no status that is not in the document.
set -euo pipefail
cd "$(dirname "$0")/../.."
command -v schemathesis >/dev/null || { echo "make fuzz: schemathesis is missing (pip install schemathesis)" >&2; exit 1; }

work=$(mktemp -d)
trap '[ -z "${server:-}" ] || kill "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
# Scenes that happen to be valid are rendered, but not for long.
NEPHROID_LOG=error target/release/nephroid-api --listen 127.0.0.1:0 --data "$work/data" --max-seconds 1 \
  --max-pixels 100000 --queue 20 > "$work/out" &
server=$!
until grep -qs listening "$work/out"; do kill -0 "$server"; sleep 0.05; done
api=$(sed 's/listening on //' "$work/out")
schemathesis run "$api/openapi.json" --url "$api" --checks not_a_server_error,status_code_conformance \
  --max-examples "${EXAMPLES:-200}" --phases examples,coverage,fuzzing --request-timeout 40 --workers 2 --no-color
