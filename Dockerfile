# Both programs in one small image; starts the service.
#
#   docker build -t nephroid .
#   docker run --rm -v nephroid-data:/data nephroid nephroid-api keys add me      # prints the key, this once
#   docker run --rm --read-only -p 8080:8080 -v nephroid-data:/data nephroid
#   docker run --rm -v "$PWD:/work" -w /work nephroid nephroid render scene.json -o out.png
#
# Inside the container the service listens on all addresses, which it does only with keys or with NEPHROID_OPEN=true.
# compose.yaml does the latter and publishes the port on loopback alone.

# Other images with a Rust toolchain or with glibc will do: see `make image`.
ARG BUILD_IMAGE=rust:1.95-bookworm
ARG BASE_IMAGE=debian:bookworm-slim

FROM ${BUILD_IMAGE} AS build
WORKDIR /src
COPY . .
RUN cargo build --release --locked --workspace --bins \
    && install -D -t /out target/release/nephroid target/release/nephroid-api

FROM ${BASE_IMAGE}
RUN useradd --system --uid 10001 --home-dir /data nephroid && install -d -o nephroid /data
COPY --from=build /out/ /usr/local/bin/
USER nephroid
WORKDIR /data
ENV NEPHROID_LISTEN=0.0.0.0:8080 NEPHROID_DATA=/data
EXPOSE 8080
VOLUME /data
HEALTHCHECK --interval=10s --timeout=3s --start-period=10s CMD ["nephroid-api", "ready"]
# SIGTERM: the service puts running jobs aside and goes on with them when it starts again.
STOPSIGNAL SIGTERM
CMD ["nephroid-api"]
