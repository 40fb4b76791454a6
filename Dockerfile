# Both programs in one small image; starts the service.
#
#   docker build -t nephroid .
#   docker run --rm -p 127.0.0.1:8080:8080 -v nephroid-data:/data nephroid
#   docker run --rm -v "$PWD:/work" -w /work nephroid nephroid render scene.json -o out.png
#
# Inside the container the service listens on all addresses, which it does only with --open: whoever can
# reach the published port may use it. Publish it on loopback as above, or behind a proxy with access control.

FROM rust:1.95-bookworm AS build
WORKDIR /src
COPY . .
RUN cargo build --release --locked --workspace --bins

FROM debian:bookworm-slim
RUN useradd --system --uid 10001 --home-dir /data nephroid && install -d -o nephroid /data
COPY --from=build /src/target/release/nephroid /src/target/release/nephroid-api /usr/local/bin/
USER nephroid
WORKDIR /data
ENV NEPHROID_LISTEN=0.0.0.0:8080 NEPHROID_DATA=/data NEPHROID_OPEN=true
EXPOSE 8080
VOLUME /data
# SIGTERM: the service puts running jobs aside and goes on with them when it starts again.
STOPSIGNAL SIGTERM
CMD ["nephroid-api"]
