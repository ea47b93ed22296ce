# The command rilievo in a container, for continuous integration: no shell, no package manager.
#   docker run --rm --user "$(id -u)" -v "$PWD:/data" rilievo reconstruct scan.ply -o mesh.glb
# The context is what release/make.sh has laid out of a finished build on Debian 12.
FROM scratch
ARG VERSION=
ARG REVISION=
LABEL org.opencontainers.image.title="rilievo" \
      org.opencontainers.image.description="The command rilievo: displaced subdivision surfaces from point clouds" \
      org.opencontainers.image.licenses="Apache-2.0" \
      org.opencontainers.image.version="${VERSION}" \
      org.opencontainers.image.revision="${REVISION}" \
      org.opencontainers.image.base.name="docker.io/library/debian:bookworm-slim"
COPY libraries/ /
COPY program/ /
# For what does not fit into memory, and for who names no folder.
COPY scratch/ /
WORKDIR /data
ENTRYPOINT ["/usr/local/bin/rilievo"]
CMD ["--help"]
