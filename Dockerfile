# SPDX-License-Identifier: MIT
# Written without a Docker daemon at hand: it has not run yet.
# docker build -t symkin . && docker run --rm -v "$PWD:/work" symkin run 3RRR --out out/3RRR
FROM debian:12-slim AS build
RUN apt-get update && apt-get install -y --no-install-recommends g++ cmake ninja-build libeigen3-dev \
      libboost-dev libxsimd-dev python3-venv python3-dev
COPY . /source
RUN python3 -m venv /opt/symkin && /opt/symkin/bin/pip install --no-cache-dir '/source[figures]'

FROM debian:12-slim
RUN apt-get update && apt-get install -y --no-install-recommends python3 && rm -rf /var/lib/apt/lists/*
COPY --from=build /opt/symkin /opt/symkin
WORKDIR /work
ENTRYPOINT ["/opt/symkin/bin/symkin"]
