.PHONY: serve test bench baseline browser gallery chart chart-quick stability openapi crash load fuzz image

# Builds and starts the service on http://127.0.0.1:8080; settings as flags, e.g. `make serve ARGS="--threads 4"`.
serve:
	cargo run --release --package nephroid-api -- $(ARGS)

test: browser
	cargo test --workspace

# The hot pieces on one thread, against bench/baseline.json; rays against Embree (Debian: apt-get install libembree-dev);
# whole renders with two threads against one. Some six minutes, after compiling.
bench:
	rm -rf target/criterion
	cargo bench --bench rays --bench structures --bench passes
	cargo bench --bench baseline
	sh bench/embree/build.sh
	cargo bench --bench embree
	cargo bench --bench threads

# What the last `make bench` found becomes the baseline.
baseline:
	cargo bench --bench baseline -- --save

# The tests of the web page need a browser and its driver.
browser:
	@command -v chromium >/dev/null && command -v chromedriver >/dev/null || { \
		if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; \
		then apt-get update && apt-get install -y chromium chromium-driver; \
		else echo "make test: chromium and chromedriver are missing (Debian: apt-get install chromium chromium-driver)" >&2; exit 1; fi; }

# Every sample scene as a picture, and the page docs/gallery/README.md.
gallery:
	cargo run --release --example gallery -- $(SCENES)

# Error against CPU seconds, every method, other renderers that bench/peers/install.sh has installed, whether renders keep
# the errors they promise, times over the size of the work, and where methods fail: chart/index.html and stability/index.html.
# Drawings in docs/speed-and-accuracy.md.
FIGURES = ring-picture ring-direct ring-complete scaling-triangles
CHARTED = scenes/glass-ball.json scenes/ring.json scenes/pool.json scenes/cornell.json scenes/lens.json scenes/drink.json
PEER_SCENES = scenes/glass-ball.json scenes/ring.json scenes/pool.json scenes/cornell.json
PEER_PYTHON = $(firstword $(wildcard bench/peers/venv/bin/python) python3)
chart: stability
	$(PEER_PYTHON) bench/peers/run.py $(PEER_SCENES) -o chart/peers --seconds $(or $(SECONDS_EACH),8) --width $(or $(WIDTH),200)
	cargo run --release --package nephroid -- chart $(CHARTED) -o chart --seconds $(or $(SECONDS_EACH),8) --width $(or $(WIDTH),200) --scaling \
		--peers chart/peers --honesty 100
	mkdir -p docs/charts
	cp $(foreach figure,$(FIGURES),chart/$(figure).svg) docs/charts/

# The same of three scenes, as a look of three minutes; `PROFILE=` for the profile of the tests, which are compiled already.
PROFILE = --release
CHARTED_QUICK = scenes/glass-ball.json scenes/ring.json scenes/cornell.json
chart-quick:
	cargo run $(PROFILE) --package nephroid -- chart $(CHARTED_QUICK) -o chart-quick --quick --scaling

# Scenes in which methods of this kind break, by every method: stability/index.html.
stability:
	cargo run --release --package nephroid -- stability -o stability

# The document of the service's addresses, after they have changed.
openapi:
	cargo run --package nephroid-api -- openapi > api/openapi.json.new && mv api/openapi.json.new api/openapi.json

# Kills the service 200 times under load; nothing is lost, nothing done twice, the bytes are the same.
crash:
	NEPHROID_TEST_KILLS=$(or $(KILLS),200) cargo test --package nephroid-api --test http -- kill:: --nocapture

# How many requests a second the service answers, on loopback, and what it costs over the command (needs wrk:
# apt-get install wrk).
load:
	cargo build --release --package nephroid-api --package nephroid --bins
	bash tests/load/run.sh

# Random requests made from the OpenAPI document (needs schemathesis: pip install schemathesis).
fuzz:
	cargo build --release --package nephroid-api --bins
	bash tests/load/fuzz.sh

# The container image, with Docker or, without one, with buildah; starts it and renders one scene.
image:
	bash tests/image/run.sh
