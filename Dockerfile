# ins_eval in a container: docker build -t ins-eval . && docker run --rm -v "$PWD:/data" ins-eval evaluate my-flight
FROM debian:trixie-slim

RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3 python3-venv make fonts-dejavu-core \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /opt/ins_eval
COPY pyproject.toml requirements.lock README.md LICENSE Makefile ./
COPY ins_eval ins_eval
COPY trajectories trajectories
RUN make env

ENV OPENBLAS_NUM_THREADS=1
WORKDIR /data
ENTRYPOINT ["/opt/ins_eval/.venv/bin/ins-eval"]
CMD ["--help"]
