# The command line alone: a binary in an image without a shell.
#
#     docker build -t divmerge .
#
# docs/release.md says how it is run. Both images are of Debian 12, so that the binary finds the C
# library that it was built against.
FROM rust:1.95-slim-bookworm AS build
WORKDIR /divmerge
COPY . .
ARG FEATURES=""
RUN cargo build --release --locked --bin divmerge --features "$FEATURES" \
    && strip target/release/divmerge

FROM gcr.io/distroless/cc-debian12:nonroot
COPY --from=build /divmerge/target/release/divmerge /usr/local/bin/divmerge
ENTRYPOINT ["/usr/local/bin/divmerge"]
CMD ["--help"]
